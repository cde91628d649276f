"""Samples that wait until the sensors' places are known."""

from collections import deque

from pose_core.streams.samples import ImuBlock, SkeletonSample

LONGEST_NS = 30_000_000_000  # what came earlier is forgotten


class WaitingSamples(deque[SkeletonSample | ImuBlock]):
    """The last half minute of them."""

    def add(self, sample: SkeletonSample | ImuBlock) -> None:
        """Keep a sample, and forget those that are too old."""
        self.append(sample)
        while abs(_stamp_ns(sample) - _stamp_ns(self[0])) > LONGEST_NS:
            self.popleft()


def _stamp_ns(sample: SkeletonSample | ImuBlock) -> int:
    return sample.stamp_ns if isinstance(sample, SkeletonSample) else int(sample.stamps_ns[-1])
