"""Samples of the sensors, as frozen values."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray, rows_of
from pose_core.joints import TrackingState

MEASURED = ("orientation", "orientation_stddev", "angular_velocity", "linear_acceleration")
"""What an IMU's sample and a block of samples have in common."""

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class SkeletonSample:
    """One person's joints as measured by one sensor."""

    stamp_ns: int  # [ns] moment of capture
    sensor: str
    person: str
    positions: FloatArray  # (15, 3) [m] in the sensor's optical frame; NaN where not tracked
    tracking_state: NDArray[np.uint8]  # (15,), values of TrackingState

    @property
    def tracked(self) -> FloatArray:
        """Positions of the joints whose state is TRACKED, (15, 3) [m]; NaN of all others."""
        is_tracked = self.tracking_state == int(TrackingState.TRACKED)
        return np.where(is_tracked[:, None], self.positions, np.nan)


SensorFrame = Sequence[SkeletonSample]
"""Everybody in one frame of a camera."""


@dataclass(frozen=True, kw_only=True)
class ImuSample:
    """One IMU's orientation, angular velocity and acceleration."""

    stamp_ns: int  # [ns] moment of capture
    segment: str
    orientation: FloatArray  # (4,) quaternion x, y, z, w: R_world_sensor, world z up
    orientation_stddev: FloatArray  # (3,) [rad] about the world's x, y, z
    angular_velocity: FloatArray  # (3,) [rad/s] in the sensor's frame
    linear_acceleration: FloatArray = field(  # (3,) [m/s²] in the sensor's frame, gravity in it
        default_factory=lambda: np.full(3, np.nan)  # NaN: not known
    )


@dataclass(frozen=True, kw_only=True)
class ImuBlock:
    """n samples of several IMUs, in the order of their arrival; see :class:`ImuSample`.

    Its arrays are contiguous, as the kernels need them.
    """

    segments: tuple[str, ...]
    imu: NDArray[np.int64]  # (n,) index into ``segments``
    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    orientation: FloatArray  # (n, 4)
    orientation_stddev: FloatArray  # (n, 3) [rad]
    angular_velocity: FloatArray  # (n, 3) [rad/s]
    linear_acceleration: FloatArray  # (n, 3) [m/s²]; NaN: not known

    def __post_init__(self) -> None:
        for name in ("imu", "stamps_ns", *MEASURED):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def rows(self, chosen: slice | NDArray[np.intp]) -> "ImuBlock":
        """A block of some rows."""
        return rows_of(self, chosen)


def block_of(sample: ImuSample) -> ImuBlock:
    """A block of one sample."""
    return _block_of_all([sample])


def joined(samples: Sequence[ImuSample | ImuBlock]) -> ImuBlock:
    """Concatenate samples and blocks of samples."""
    if not samples:
        return _NO_SAMPLES
    singles = [each for each in samples if isinstance(each, ImuSample)]
    if len(singles) == len(samples):
        return _block_of_all(singles)
    blocks = [block_of(each) if isinstance(each, ImuSample) else each for each in samples]
    segments = tuple(dict.fromkeys(name for block in blocks for name in block.segments))
    index = {name: i for i, name in enumerate(segments)}
    places = [np.array([index[name] for name in block.segments], np.int64) for block in blocks]
    return ImuBlock(
        segments=segments,
        imu=np.concatenate([p[b.imu] for p, b in zip(places, blocks, strict=True)]),
        stamps_ns=np.concatenate([block.stamps_ns for block in blocks]),
        **{name: np.concatenate([getattr(b, name) for b in blocks]) for name in MEASURED},
    )


def _block_of_all(samples: Sequence[ImuSample]) -> ImuBlock:
    segments = tuple(dict.fromkeys(sample.segment for sample in samples))
    index = {name: i for i, name in enumerate(segments)}
    return ImuBlock(
        segments=segments,
        imu=np.array([index[sample.segment] for sample in samples], np.int64),
        stamps_ns=np.array([sample.stamp_ns for sample in samples], np.int64),
        **{name: np.array([getattr(sample, name) for sample in samples]) for name in MEASURED},
    )


def interleaved(
    frames: Iterable[T], block: ImuBlock, stops: NDArray[np.intp]
) -> Iterator[T | ImuBlock]:
    """Frames, each behind the IMU samples that come before it; then the remaining samples.

    Args:
        frames: k frames, in order.
        block: The IMUs' samples, in order.
        stops: Number of samples that come before each frame, (k,).
    """
    start = 0
    for stop, frame in zip(stops.tolist(), frames, strict=True):
        if start < stop:
            yield block.rows(slice(start, stop))
            start = stop
        yield frame
    if start < len(block):
        yield block.rows(slice(start, None))


_NO_SAMPLES = ImuBlock(
    segments=(),
    imu=np.zeros(0, np.int64),
    stamps_ns=np.zeros(0, np.int64),
    **{name: np.zeros((0, 4 if name == "orientation" else 3)) for name in MEASURED},
)
