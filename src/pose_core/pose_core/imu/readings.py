"""What aligned IMUs say of their segments at one instant."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class SegmentReading:
    """What an aligned IMU says of its segment."""

    R_map_segment: FloatArray  # (3, 3)
    angular_velocity: FloatArray  # (3,) [rad/s] in map
    stddev: FloatArray  # (3,) [rad] about map's axes: of the tilt, of the heading
    age_s: float = 0.0  # [s] for which the gyroscope has carried it on


@dataclass(frozen=True, kw_only=True, eq=False)
class SegmentReadings(Mapping[str, SegmentReading]):
    """The same of several IMUs, a row each; also by segment."""

    segments: tuple[str, ...]
    R_map_segment: FloatArray  # (n, 3, 3)
    angular_velocity: FloatArray  # (n, 3) [rad/s] in map
    stddev: FloatArray  # (n, 3) [rad] about map's axes
    age_s: FloatArray  # (n,) [s]

    def __getitem__(self, segment: str) -> SegmentReading:
        if segment not in self.segments:
            raise KeyError(segment)
        row = self.segments.index(segment)
        return SegmentReading(
            R_map_segment=self.R_map_segment[row],
            angular_velocity=self.angular_velocity[row],
            stddev=self.stddev[row],
            age_s=float(self.age_s[row]),
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self.segments)

    def __len__(self) -> int:
        return len(self.segments)


def readings_of(readings: Mapping[str, SegmentReading]) -> SegmentReadings:
    """Single readings as rows."""
    each = list(readings.values())
    return SegmentReadings(
        segments=tuple(readings),
        R_map_segment=np.array([r.R_map_segment for r in each]).reshape(-1, 3, 3),
        angular_velocity=np.array([r.angular_velocity for r in each]).reshape(-1, 3),
        stddev=np.array([r.stddev for r in each]).reshape(-1, 3),
        age_s=np.array([r.age_s for r in each], float),
    )


NO_READINGS = readings_of({})
"""Of no IMUs."""
