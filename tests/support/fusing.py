"""Samples through the pipeline, as a live node or a tool feeds it."""

from pose_core.streams.samples import ImuSample, joined


def blocks_between_frames(samples):
    """Skeletons, and the IMU samples that arrive between two of them as one block."""
    since_frame = []
    for sample in samples:
        if isinstance(sample, ImuSample):
            since_frame.append(sample)
            continue
        if since_frame:
            yield joined(since_frame)
            since_frame = []
        yield sample
    if since_frame:
        yield joined(since_frame)


def fused(pipeline, samples):
    """All estimates of samples in the order of their arrival, up to the end of the streams."""
    estimates = [e for sample in blocks_between_frames(samples) for e in pipeline.add(sample)]
    return estimates + pipeline.flush()
