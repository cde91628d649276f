"""Arrays with values that may not be finite: validation, and means of the finite ones."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def finite_numbers(value: Any, *shape: int) -> NDArray[np.float64] | None:
    """Convert a value from a file to an array; None unless all are finite and the shape fits."""
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return numbers if numbers.shape == shape and np.isfinite(numbers).all() else None


def nan_mean(values: NDArray[np.float64], axis: int = 0) -> NDArray[np.float64]:
    """Mean along an axis, ignoring NaN; NaN, without a warning, where all are NaN."""
    known = np.isfinite(values)
    count = known.sum(axis=axis)
    total = np.where(known, values, 0.0).sum(axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def mean_known(values: ArrayLike) -> float:
    """Mean of all values that are not NaN; NaN if there are none."""
    known = np.asarray(values, float)[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan
