"""What is kept of the IMUs' samples for finding their clocks and the vertical."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

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
        # By segment: of each block, stamps [ns], (n,), and quaternions, (n, 4).
        self._samples: dict[str, list[tuple[NDArray[np.int64], FloatArray]]] = {}
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
        newest_ns = dict(zip(block.imu.tolist(), block.stamps_ns.tolist(), strict=True))
        for imu, stamp_ns in newest_ns.items():
            leads_ns = self._leads_ns.setdefault(block.segments[imu], deque(maxlen=LEADS_KEPT))
            leads_ns.append(stamp_ns - float(np.median([*newest_ns.values()])))
        for imu in newest_ns:
            if block.segments[imu] in SEGMENT_ENDS:
                own = np.flatnonzero(block.imu == imu)
                self._add(block.segments[imu], block.stamps_ns[own], block.orientation[own])

    @property
    def leads_s(self) -> dict[str, float]:
        """By how much each IMU's stamps are ahead of the others' that arrive with them [s]."""
        return {name: float(np.median(each)) / NS_PER_S for name, each in self._leads_ns.items()}

    def _add(self, segment: str, stamps_ns: NDArray[np.int64], orientation: FloatArray) -> None:
        samples = self._samples.setdefault(segment, [])
        last_ns = int(samples[-1][0][-1]) if samples else int(stamps_ns[0]) - EVERY_NS
        rows: list[int] = []
        for row, stamp_ns in enumerate(stamps_ns.tolist()):
            if -JUMP_BACK_NS < stamp_ns - last_ns < EVERY_NS:
                continue
            if stamp_ns < last_ns:  # the clock was set back, or a recording restarted
                samples.clear()
                rows.clear()
            rows.append(row)
            last_ns = stamp_ns
        if rows:
            samples.append((stamps_ns[rows], orientation[rows]))
        if last_ns - int(samples[0][0][0]) > 2 * self._reach_ns:
            samples[:] = [
                (ns[is_kept], quaternions[is_kept])
                for ns, quaternions in samples
                if (is_kept := ns >= last_ns - self._reach_ns).any()
            ]

    def verticals(self, begin_ns: int) -> dict[str, Track]:
        """Vertical in each IMU's frame, by segment; stamps in seconds since ``begin_ns``."""
        # Imported here: scipy takes half a second to load, not at a node's start.
        from scipy.spatial.transform import Rotation

        tracks = {}
        for segment in self.segments:
            stamps_ns, quaternions = map(np.concatenate, zip(*self._samples[segment], strict=True))
            if len(stamps_ns) > 1:
                ups = Rotation.from_quat(quaternions).inv().apply(UP)
                tracks[segment] = Track((stamps_ns - begin_ns) * 1e-9, ups)
        return tracks
