"""One IMU's part of the alignment: its mounting, from the neutral pose, and its heading."""

import math

import numpy as np

from pose_core.imu.heading import HeadingAnchor
from pose_core.imu.mounting import Mounting
from pose_core.imu.track import ImuState
from pose_core.kernels import alignment as kernel
from pose_core.kernels.anchors import joined, make_anchors
from pose_core.streams.samples import FloatArray

STANDING_STDDEV = math.radians(4.0)  # [rad] by which people stand beside a segment's heading


class AlignmentRows:
    """All IMUs' headings and mountings, a row each."""

    def __init__(self) -> None:
        self.anchors = make_anchors(0)
        self.mounted = kernel.Mountings(np.empty((0, 3, 3)), np.empty(0))

    def append(self) -> int:
        """Make room for another IMU; its row."""
        new = kernel.Mountings(np.full((1, 3, 3), np.nan), np.zeros(1))
        mounted = zip(self.mounted, new, strict=True)
        self.anchors = joined(self.anchors, make_anchors(1))
        self.mounted = kernel.Mountings(*(np.concatenate(pair) for pair in mounted))
        return len(self.mounted.body_heading) - 1


class SegmentAlignment:
    """One IMU's mounting, from the neutral pose, and its heading.

    Args:
        rows: Where it is kept, in a row of its own.
    """

    def __init__(self, rows: AlignmentRows) -> None:
        self._rows = rows
        self.row = rows.append()
        self._neutral: list[FloatArray] = []
        self.mounting: Mounting | None = None  # where a calibration has found it
        self.has_stood = False

    @property
    def anchor(self) -> HeadingAnchor:
        """The heading of its world."""
        return HeadingAnchor(anchors=self._rows.anchors, row=self.row)

    @property
    def is_mounted(self) -> bool:
        """Whether the mounting is known."""
        return bool(kernel.is_mounted(self._rows.mounted, self.row))

    def _take_mounting(self, R_world_sensor_neutral: FloatArray, body_heading: float) -> None:
        self._rows.mounted.R_world_sensor_neutral[self.row] = R_world_sensor_neutral
        self._rows.mounted.body_heading[self.row] = body_heading

    def use_mounting(self, mounting: Mounting) -> None:
        """Take the mounting as it is, from a calibration; only the heading is sought."""
        self.mounting = mounting
        self._take_mounting(mounting.R_sensor_segment.T, body_heading=0.0)
        self.anchor.reset(is_mounting_known=True)

    def collect_neutral(self, state: ImuState) -> None:
        """Remember a reading of the neutral pose."""
        self._neutral.append(state.R_world_sensor)

    def forget_neutral(self) -> None:
        """The person moved before the pose had been held for long enough."""
        self._neutral.clear()

    def finish_neutral(self, body_heading: float) -> None:
        """Take the mean of the collected readings as the mounting; the heading is sought anew."""
        if not self._neutral:
            return
        mean = mean_rotation(np.stack(self._neutral))
        self.has_stood = True
        if self.mounting is not None:
            x, y, _ = (mean @ self.mounting.R_sensor_segment)[:, 0]
            turn = math.remainder(body_heading - math.atan2(y, x), 2.0 * math.pi)
            self.anchor.observe_standing(turn, STANDING_STDDEV)
            self._neutral.clear()
            return
        self._take_mounting(mean, body_heading)
        self.anchor.reset()
        self._neutral.clear()


def mean_rotation(rotations: FloatArray) -> FloatArray:
    """The rotation that is nearest to some, (n, 3, 3), in the sum of squares of all elements.

    References:
        Markley et al. (2007), Journal of Guidance, Control, and Dynamics 30(4).
    """
    U, _, Vt = np.linalg.svd(rotations.sum(axis=0))
    U[:, 2] *= np.sign(np.linalg.det(U @ Vt))
    return np.asarray(U @ Vt)
