"""Buffer of the samples that arrive before the extrinsics are known."""

from collections import deque
from collections.abc import Sequence
from typing import Generic, TypeVar

from pose_core.counters import Counters
from pose_core.streams.samples import ImuBlock, SkeletonSample

MAX_DURATION_NS = 30_000_000_000  # [ns] older samples are discarded
DISCARDED_SKELETONS = "skeletons_discarded_before_extrinsics"
DISCARDED_IMU_SAMPLES = "imu_samples_discarded_before_extrinsics"
COUNTERS = (DISCARDED_SKELETONS, DISCARDED_IMU_SAMPLES)

S = TypeVar("S", SkeletonSample, Sequence[SkeletonSample])


class SampleBuffer(deque[S | ImuBlock], Generic[S]):
    """Samples of the last half minute: IMUs and one person's skeletons, or whole frames.

    Args:
        counters: Declares :data:`COUNTERS`, which count discarded samples.
    """

    def __init__(self, counters: Counters) -> None:
        super().__init__()
        self._counters = counters

    def add(self, sample: S | ImuBlock) -> None:
        """Append a non-empty sample, and discard those that are too old."""
        self.append(sample)
        while abs(_stamp_ns(sample) - _stamp_ns(self[0])) > MAX_DURATION_NS:
            discarded = self.popleft()
            if isinstance(discarded, ImuBlock):
                self._counters.add(DISCARDED_IMU_SAMPLES, len(discarded))
            else:
                count = 1 if isinstance(discarded, SkeletonSample) else len(discarded)
                self._counters.add(DISCARDED_SKELETONS, count)


def _stamp_ns(sample: SkeletonSample | Sequence[SkeletonSample] | ImuBlock) -> int:
    if isinstance(sample, ImuBlock):
        return int(sample.stamps_ns[-1])
    return sample.stamp_ns if isinstance(sample, SkeletonSample) else sample[0].stamp_ns
