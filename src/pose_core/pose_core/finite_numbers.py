"""Numbers that people or other programs have written into a file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def finite_numbers(value: Any, *shape: int) -> NDArray[np.float64] | None:
    """An array of a value read from a file; None unless it is finite numbers of this shape."""
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return numbers if numbers.shape == shape and np.isfinite(numbers).all() else None
