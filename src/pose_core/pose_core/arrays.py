"""The array type of all continuous quantities, tables of arrays, directions, quaternions."""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Table = TypeVar("Table", bound=Any)


def fields_at(table: Any, chosen: int | slice | NDArray[Any]) -> dict[str, Any]:
    """Fields of a dataclass by name, of those that are arrays some rows only."""
    return {
        name: value[chosen] if isinstance(value, np.ndarray) else value
        for name, value in vars(table).items()
    }


def rows_of(table: Table, chosen: slice | NDArray[Any]) -> Table:
    """Some rows of a dataclass whose arrays all have n rows."""
    rows: Table = type(table)(**fields_at(table, chosen))
    return rows


def rows_between(table: Table, begin_ns: int, end_ns: int) -> Table:
    """The rows whose ``stamps_ns`` are from ``begin_ns`` to ``end_ns`` [ns], inclusive."""
    return rows_of(table, (table.stamps_ns >= begin_ns) & (table.stamps_ns <= end_ns))


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """Directions of vectors along the last axis; NaN where a vector is zero or NaN."""
    with np.errstate(invalid="ignore", divide="ignore"):
        directions: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return directions


def without_sign_changes(quaternions: FloatArray) -> FloatArray:
    """The same rotations with no change of sign from one quaternion to the next, shape (n, 4)."""
    flips = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0
    return quaternions * np.cumprod([1.0, *np.where(flips, -1.0, 1.0)])[:, None]
