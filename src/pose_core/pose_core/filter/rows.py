"""Measurement rows of one robust update: residuals, their derivatives and their noise."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled
from pose_core.streams.samples import FloatArray

NORMAL = 0.0  # [-] degrees of freedom that stand for a normal distribution: weight 1 always


class Rows(NamedTuple):
    """m scalar rows in groups that share a weight; a group has one row or three.

    ``filled`` holds how many rows and groups are in use.
    """

    H: FloatArray  # (most rows, n) derivatives by the error
    residual: FloatArray  # (most rows,)
    first: NDArray[np.int64]  # (most groups,) row
    size: NDArray[np.int64]  # (most groups,) 1 or 3
    noise: FloatArray  # (most groups, 3, 3) covariance
    student_dof: FloatArray  # (most groups,) of Student's t; NORMAL
    student_scale: FloatArray  # (most groups,) factor of the squared residual distance
    source: NDArray[np.int64]  # (most groups,) joint or link that the group measures
    filled: NDArray[np.int64]  # (2,) how many rows and groups


@compiled
def make_rows(most_rows: int, most_groups: int, size: int) -> Rows:
    """Room for rows of an error of ``size``."""
    return Rows(
        np.zeros((most_rows, size)),
        np.zeros(most_rows),
        np.zeros(most_groups, np.int64),
        np.zeros(most_groups, np.int64),
        np.zeros((most_groups, 3, 3)),
        np.zeros(most_groups),
        np.ones(most_groups),
        np.zeros(most_groups, np.int64),
        np.zeros(2, np.int64),
    )


@compiled
def add_group(rows: Rows, size: int, student_dof: float, source: int) -> int:
    """Open a group of 1 or 3 rows; returns its number. Its rows and noise are zero."""
    group = rows.filled[1]
    rows.first[group] = rows.filled[0]
    rows.size[group] = size
    rows.student_dof[group] = student_dof
    rows.source[group] = source
    rows.filled[0] += size
    rows.filled[1] += 1
    return group
