"""Numbers of which some may not be finite: what a file holds, and means of what is known."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def finite_numbers(value: Any, *shape: int) -> NDArray[np.float64] | None:
    """An array of a value read from a file; None unless it is finite numbers of this shape."""
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return numbers if numbers.shape == shape and np.isfinite(numbers).all() else None


def nan_mean(values: NDArray[np.float64], axis: int = 0) -> NDArray[np.float64]:
    """Mean along an axis of what is known; NaN, and no warning, where nothing is."""
    known = np.isfinite(values)
    count = known.sum(axis=axis)
    total = np.where(known, values, 0.0).sum(axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def mean_known(values: ArrayLike) -> float:
    """Mean of all that is known; NaN where nothing is."""
    known = np.asarray(values, float)[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan
