"""What sensors say of an instant; many of them as few arrays, which is quick to hand over."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pose_core.body.shape import BodyShape
from pose_core.imu.readings import NO_READINGS, SegmentReadings
from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What the sensors say of one instant, in ``map``, and of whom."""

    stamp_ns: int  # [ns]
    newest_ns: int  # [ns] stamp of the newest sample of any source that had come by then
    shape: BodyShape  # the person's measures; another object is another body
    positions: FloatArray  # (sensors, 15, 3) [m]; NaN where a sensor says nothing
    tracking_state: NDArray[np.uint8]  # (sensors, 15), values of TrackingState
    cameras: FloatArray  # (sensors, 3) [m] where the sensors stand; NaN not placed
    offsets: FloatArray  # (sensors, 15, 3) [m] of each tracker's joints, in heading axes
    readings: SegmentReadings  # of the aligned IMUs


@dataclass(frozen=True, kw_only=True)
class ObservationBlock:
    """n observations of one body, with m IMUs' readings in all; see :class:`Observation`."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    newest_ns: NDArray[np.int64]  # (n,) [ns]
    positions: FloatArray  # (n, sensors, 15, 3) [m]
    tracking_state: NDArray[np.uint8]  # (n, sensors, 15)
    cameras: FloatArray  # (n, sensors, 3) [m]
    offsets: FloatArray  # (n, sensors, 15, 3) [m]
    segments: tuple[tuple[str, ...], ...]  # n times those whose IMUs spoke
    R_map_segment: FloatArray  # (m, 3, 3) of all readings, one after the other
    angular_velocity: FloatArray  # (m, 3) [rad/s]
    stddev: FloatArray  # (m, 3) [rad]
    age_s: FloatArray  # (m,) [s]

    def observations(self, shape: BodyShape) -> Iterator[Observation]:
        """Each by itself; their arrays are the block's.

        Args:
            shape: Of the body.
        """
        rows = zip(
            self.stamps_ns.tolist(),
            self.newest_ns.tolist(),
            self.positions,
            self.tracking_state,
            self.cameras,
            self.offsets,
            self._readings(),
            strict=True,
        )
        for stamp_ns, newest_ns, positions, tracking_state, cameras, offsets, readings in rows:
            yield Observation(
                stamp_ns=stamp_ns,
                newest_ns=newest_ns,
                shape=shape,
                positions=positions,
                tracking_state=tracking_state,
                cameras=cameras,
                offsets=offsets,
                readings=readings,
            )

    def _readings(self) -> Iterator[SegmentReadings]:
        places = pairwise(accumulate(map(len, self.segments), initial=0))
        for segments, (start, stop) in zip(self.segments, places, strict=True):
            if start == stop:
                yield NO_READINGS
                continue
            yield SegmentReadings(
                segments=segments,
                R_map_segment=self.R_map_segment[start:stop],
                angular_velocity=self.angular_velocity[start:stop],
                stddev=self.stddev[start:stop],
                age_s=self.age_s[start:stop],
            )


def block_of_observations(observations: Sequence[Observation]) -> ObservationBlock:
    """Observations of one body, one at least, as a block."""
    readings = [each.readings for each in observations]
    same: dict[tuple[str, ...], tuple[str, ...]] = {}  # what is one object is pickled once
    return ObservationBlock(
        stamps_ns=np.array([each.stamp_ns for each in observations], np.int64),
        newest_ns=np.array([each.newest_ns for each in observations], np.int64),
        positions=stacked([each.positions for each in observations]),
        tracking_state=stacked([each.tracking_state for each in observations]),
        cameras=stacked([each.cameras for each in observations]),
        offsets=stacked([each.offsets for each in observations]),
        segments=tuple(same.setdefault(each.segments, each.segments) for each in readings),
        R_map_segment=_joined([each.R_map_segment for each in readings]),
        angular_velocity=_joined([each.angular_velocity for each in readings]),
        stddev=_joined([each.stddev for each in readings]),
        age_s=_joined([each.age_s for each in readings]),
    )


def stacked(rows: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """One after the other, in contiguous rows; one alone is not copied for that."""
    return np.ascontiguousarray(rows[0])[None] if len(rows) == 1 else np.array(rows)


def _joined(parts: Sequence[FloatArray]) -> FloatArray:
    """The rows of all, likewise."""
    return np.ascontiguousarray(parts[0]) if len(parts) == 1 else np.concatenate(parts)
