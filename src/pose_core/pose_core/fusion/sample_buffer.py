"""Buffer of the samples that come before the extrinsics are known."""

from collections import deque

from pose_core.streams.samples import ImuBlock, SkeletonSample

LONGEST_NS = 30_000_000_000  # older samples are discarded


class SampleBuffer(deque[SkeletonSample | ImuBlock]):
    """The samples of the last half minute."""

    def add(self, sample: SkeletonSample | ImuBlock) -> None:
        """Append a sample, and discard those that are too old."""
        self.append(sample)
        while abs(_stamp_ns(sample) - _stamp_ns(self[0])) > LONGEST_NS:
            self.popleft()


def _stamp_ns(sample: SkeletonSample | ImuBlock) -> int:
    return sample.stamp_ns if isinstance(sample, SkeletonSample) else int(sample.stamps_ns[-1])
