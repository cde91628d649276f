"""The array type of all continuous quantities, tables of arrays, and directions."""

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


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """Directions of vectors along the last axis; NaN where a vector is zero or NaN."""
    with np.errstate(invalid="ignore", divide="ignore"):
        directions: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return directions
