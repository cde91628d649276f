"""What is kept of the IMUs' samples for finding their clocks and the vertical."""

from collections import deque

import numpy as np

from pose_calibration.clocks.motion_track import Track
from pose_core.api import FloatArray, ImuBlock
from pose_core.imu.angular_velocity_check import AngularVelocityCheck
from pose_core.imu.burst_stamps import BurstStamps
from pose_core.joints import SEGMENT_ENDS
from pose_core.stamps import JUMP_BACK_NS, NS_PER_S

EVERY_NS = 19_000_000  # [ns] smallest interval between stored samples
LEADS_KEPT = 2000  # [-] of an IMU
UP = np.array([0.0, 0.0, 1.0])


class ImuMemory:
    """Orientations of each IMU at a reduced rate; none of IMUs whose orientations are the inverse.

    Args:
        reach_ns: Duration stored [ns]; older samples are dropped.
    """

    def __init__(self, reach_ns: int = 2**62) -> None:
        self._reach_ns = reach_ns
        self._bursts = BurstStamps()
        self._rates = AngularVelocityCheck()  # finds the inverse ones
        self._samples: dict[str, list[tuple[int, FloatArray]]] = {}  # stamp [ns], quaternion
        self._leads_ns: dict[str, deque[float]] = {}  # before the other IMUs, as samples arrive

    @property
    def segments(self) -> tuple[str, ...]:
        """Segments with usable IMU samples that cameras can measure."""
        return tuple(sorted(self._samples.keys() - self._rates.inverse - self._rates.undecided))

    def add(self, block: ImuBlock) -> None:
        """Append samples, at least :data:`EVERY_NS` apart."""
        block = block.rows(np.flatnonzero(np.isfinite(block.orientation).all(axis=1)))
        block = self._bursts.restored(block)
        self._rates.checked(block)
        samples = list(zip(block.imu.tolist(), block.stamps_ns.tolist(), strict=True))
        newest_ns = dict(samples)  # of each IMU, its last sample
        for imu, stamp_ns in newest_ns.items():
            leads_ns = self._leads_ns.setdefault(block.segments[imu], deque(maxlen=LEADS_KEPT))
            leads_ns.append(stamp_ns - float(np.median([*newest_ns.values()])))
        for row, (imu, stamp_ns) in enumerate(samples):
            if block.segments[imu] in SEGMENT_ENDS:
                self._add(block.segments[imu], stamp_ns, block.orientation, row)

    @property
    def leads_s(self) -> dict[str, float]:
        """By how much each IMU's stamps are ahead of the others' that arrive with them [s]."""
        return {name: float(np.median(each)) / NS_PER_S for name, each in self._leads_ns.items()}

    def _add(self, segment: str, stamp_ns: int, orientation: FloatArray, row: int) -> None:
        samples = self._samples.setdefault(segment, [])
        if samples and -JUMP_BACK_NS < stamp_ns - samples[-1][0] < EVERY_NS:
            return
        if samples and stamp_ns < samples[-1][0]:
            samples.clear()  # the clock was set back, or a recording restarted
        samples.append((stamp_ns, orientation[row]))
        if stamp_ns - samples[0][0] > 2 * self._reach_ns:
            samples[:] = [one for one in samples if one[0] >= stamp_ns - self._reach_ns]

    def verticals(self, begin_ns: int) -> dict[str, Track]:
        """Vertical in each IMU's frame, by segment; stamps in seconds since ``begin_ns``."""
        # Imported here: scipy takes half a second to load, not at a node's start.
        from scipy.spatial.transform import Rotation

        tracks = {}
        for segment in self.segments:
            stamps_ns, quaternions = zip(*self._samples[segment], strict=True)
            if len(stamps_ns) > 1:
                ups = Rotation.from_quat(np.array(quaternions)).inv().apply(UP)
                tracks[segment] = Track((np.array(stamps_ns) - begin_ns) * 1e-9, ups)
        return tracks
