"""One IMU's recent past, and its orientation at any instant within it."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from pose_fusion.kernels.imu import interpolate, turn_on
from pose_fusion.streams.samples import FloatArray, ImuSample

NS_PER_S = 1_000_000_000
HISTORY_NS = NS_PER_S
MAX_GAP_NS = 100_000_000  # nothing is said over a longer silence


@dataclass(frozen=True, kw_only=True)
class ImuState:
    """An IMU's interpolated reading."""

    R_world_sensor: FloatArray  # (3, 3)
    angular_velocity: FloatArray  # (3,) [rad/s] in the sensor's frame
    stddev: FloatArray  # (3,) [rad] about the world's axes


class ImuTrack:
    """Keeps the last second of one IMU, in the order of its stamps."""

    def __init__(self) -> None:
        self._samples: deque[ImuSample] = deque()

    @property
    def newest_ns(self) -> int | None:
        """Stamp of the newest sample."""
        return self._samples[-1].stamp_ns if self._samples else None

    def add(self, sample: ImuSample) -> bool:
        """Keep a sample; False if its stamp is not newer than the last one's."""
        newest = self.newest_ns
        if newest is not None and sample.stamp_ns <= newest:
            if newest - sample.stamp_ns < HISTORY_NS:
                return False
            self._samples.clear()  # the clock was set back: begin anew
        self._samples.append(sample)
        while self._samples[0].stamp_ns < sample.stamp_ns - HISTORY_NS:
            self._samples.popleft()
        return True

    def at(self, stamp_ns: int) -> ImuState | None:
        """The reading at an instant, interpolated; None where there is none nearby."""
        before = after = None
        for sample in reversed(self._samples):
            if sample.stamp_ns >= stamp_ns:
                after = sample
            else:
                before = sample
                break
        if after is None or before is None:
            nearest = after or before
            if nearest is None or abs(nearest.stamp_ns - stamp_ns) > MAX_GAP_NS:
                return None
            # The gyroscope carries the orientation over a sample that is late.
            turn = nearest.angular_velocity * (stamp_ns - nearest.stamp_ns) / NS_PER_S
            R_world_sensor = np.empty((3, 3))
            turn_on(nearest.orientation, turn, R_world_sensor)
            return ImuState(
                R_world_sensor=R_world_sensor,
                angular_velocity=nearest.angular_velocity,
                stddev=nearest.orientation_stddev,
            )
        if after.stamp_ns - before.stamp_ns > MAX_GAP_NS:
            return None
        share = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
        R_world_sensor = np.empty((3, 3))
        interpolate(before.orientation, after.orientation, share, R_world_sensor)
        return ImuState(
            R_world_sensor=R_world_sensor,
            angular_velocity=(1.0 - share) * before.angular_velocity
            + share * after.angular_velocity,
            stddev=after.orientation_stddev,
        )
