"""The array type of all continuous quantities, tables of arrays, and directions."""

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Table = TypeVar("Table", bound=Any)


def rows_of(table: Table, chosen: int | slice | NDArray[Any]) -> Table:
    """Some rows of a dataclass whose arrays all have n rows."""
    columns = {name: each for name, each in vars(table).items() if isinstance(each, np.ndarray)}
    chosen_rows: Table = replace(table, **{name: each[chosen] for name, each in columns.items()})
    return chosen_rows


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """Directions of vectors along the last axis; NaN where a vector is zero or NaN."""
    with np.errstate(invalid="ignore", divide="ignore"):
        directions: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return directions
