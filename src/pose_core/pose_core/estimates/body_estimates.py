"""Estimates of one person's pose, at one instant or at several."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray, fields_at, rows_of


@dataclass(frozen=True, kw_only=True)
class _EstimateFields:
    """A pose with its uncertainty and provenance; arrays over d degrees of freedom."""

    dof_names: tuple[str, ...]
    position: FloatArray  # (..., d) [m] or [rad]
    velocity: FloatArray  # (..., d) [m/s] or [rad/s]
    position_stddev: FloatArray  # (..., d) [m] or [rad]
    is_known: NDArray[np.bool_]  # (..., d) whether the value is known; otherwise it is held
    weight_kinect: FloatArray  # (..., d) 0..1
    weight_imu: FloatArray  # (..., d) 0..1
    source: NDArray[np.uint8]  # (..., d), values of Source
    joints: FloatArray  # (..., 15, 3) [m] in map
    fk_joints: FloatArray  # (..., 15, 3) [m] in map, from the degrees of freedom, as in /tf
    tracking_state: NDArray[np.uint8]  # (..., 15), of the estimate
    link_names: tuple[str, ...]
    T_map_link: FloatArray  # (..., links, 4, 4), origin at the joint that the link rotates about


@dataclass(frozen=True, kw_only=True)
class BodyEstimate(_EstimateFields):
    """One person's pose at one instant, with its uncertainty and provenance."""

    stamp_ns: int  # [ns] instant of the estimate
    newest_ns: int  # [ns] stamp of the newest sample of any source received by then


@dataclass(frozen=True, kw_only=True)
class EstimateBlock(_EstimateFields):
    """n >= 1 estimates of one person, one for each row; see :class:`BodyEstimate`."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    newest_ns: NDArray[np.int64]  # (n,) [ns]

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def __iter__(self) -> Iterator[BodyEstimate]:
        return map(self.__getitem__, range(len(self)))

    def __getitem__(self, row: int) -> BodyEstimate:
        """One estimate; its arrays are views of the block's."""
        fields = fields_at(self, row)
        stamp_ns, newest_ns = int(fields.pop("stamps_ns")), int(fields.pop("newest_ns"))
        return BodyEstimate(stamp_ns=stamp_ns, newest_ns=newest_ns, **fields)

    def rows(self, rows: slice) -> "EstimateBlock":
        """A block of some rows."""
        return rows_of(self, rows)
