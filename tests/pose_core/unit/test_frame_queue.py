import numpy as np
import pytest

from pose_core.fusion.frame_queue import LATEST_ALONE_NS, FrameQueue
from pose_core.joints import JOINTS, TrackingState
from pose_core.streams.samples import SkeletonSample

MS = 1_000_000
START_NS = 10**18
LAG_NS = 60 * MS  # by which a frame's corrected stamp is behind


def skeleton(stamp_ns):
    return SkeletonSample(
        stamp_ns=stamp_ns,
        sensor="left",
        person="1",
        positions=np.zeros((len(JOINTS), 3)),
        tracking_state=np.full(len(JOINTS), TrackingState.TRACKED, np.uint8),
    )


def frames_of_imus_alone(rate, until_ms, camera_until_ms):
    """Instants at which IMUs of 100 Hz give frames beside one camera."""
    queue, due_ns = FrameQueue(None, is_live=True), START_NS
    for now_ns in range(START_NS, START_NS + until_ms * MS, 10 * MS):
        if due_ns <= now_ns < START_NS + camera_until_ms * MS:
            queue.add_skeleton(skeleton(now_ns - LAG_NS))
            due_ns += round(1e9 / rate)
        queue.add_imus(np.array([now_ns]))
    return [frame.stamp_ns for frame in queue.ready if not frame.samples]


@pytest.mark.parametrize("rate", [10.0, 15.0, 30.0])
def test_imus_give_no_frames_between_those_of_a_slow_camera(rate):
    alone = frames_of_imus_alone(rate, until_ms=3000, camera_until_ms=3000)
    assert [stamp for stamp in alone if stamp > START_NS + 500 * MS] == []


@pytest.mark.parametrize("rate", [10.0, 30.0])
def test_imus_give_frames_once_the_cameras_are_silent(rate):
    alone = frames_of_imus_alone(rate, until_ms=3000, camera_until_ms=2000)
    after = [stamp for stamp in alone if stamp > START_NS + 1500 * MS]
    assert after[0] < START_NS + 2000 * MS + LATEST_ALONE_NS + LAG_NS
    assert np.diff(after).max() <= 60 * MS
