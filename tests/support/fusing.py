"""Samples through the chain, as a live node or a tool feeds it."""

from pose_core.streams.samples import SkeletonSample


def add(pipeline, sample):
    """Give the chain a sample of either kind; the estimates that it completes."""
    take = pipeline.add_skeleton if isinstance(sample, SkeletonSample) else pipeline.add_imu
    return take(sample)


def fused(pipeline, samples):
    """All estimates of samples in the order of their arrival, up to the end of the streams."""
    return [e for sample in samples for e in add(pipeline, sample)] + pipeline.flush()
