"""Measurement rows of one robust update: residuals, their derivatives and their noise."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled

NORMAL = 0.0  # [-] degrees of freedom that denote a normal distribution: the weight is always 1


class Rows(NamedTuple):
    """m scalar measurement rows in groups of one or three that share a weight.

    ``filled`` holds the numbers of rows and groups in use.
    """

    H: FloatArray  # (most rows, n or fewer) Jacobian with respect to the error state's begin
    residual: FloatArray  # (most rows,)
    first: NDArray[np.int64]  # (most groups,) row
    size: NDArray[np.int64]  # (most groups,) 1 or 3
    noise: FloatArray  # (most groups, 3, 3) covariance
    student_dof: FloatArray  # (most groups,) of Student's t; NORMAL
    source: NDArray[np.int64]  # (most groups,) joint or link that the group measures
    common: FloatArray  # (most rows,) derivatives with respect to an error ~ N(0, 1) of all rows
    filled: NDArray[np.int64]  # (2,) numbers of rows and groups in use


@compiled
def make_rows(most_rows: int, most_groups: int, columns: int) -> Rows:
    """Allocate rows that depend on the error state's first ``columns`` elements."""
    return Rows(
        np.zeros((most_rows, columns)),
        np.zeros(most_rows),
        np.zeros(most_groups, np.int64),
        np.zeros(most_groups, np.int64),
        np.zeros((most_groups, 3, 3)),
        np.zeros(most_groups),
        np.zeros(most_groups, np.int64),
        np.zeros(most_rows),
        np.zeros(2, np.int64),
    )


@compiled
def add_group(rows: Rows, size: int, student_dof: float, source: int) -> int:
    """Append a group of 1 or 3 rows and return its index. Its rows and noise are zero."""
    group = rows.filled[1]
    rows.first[group] = rows.filled[0]
    rows.size[group] = size
    rows.student_dof[group] = student_dof
    rows.source[group] = source
    rows.filled[0] += size
    rows.filled[1] += 1
    return group
