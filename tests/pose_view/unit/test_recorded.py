"""A recording as snapshots, and bodies that are computed if they were not recorded."""

import numpy as np
import pytest
from viewed_bag import BODIES, write_viewed_bag

from pose_core.api import PipelineParameters, extrinsics_from_map
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_io.bag_samples import BagFrames
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_view.recorded import Recorded
from pose_view.tools.view import compute_bodies, missing_bodies


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recorded") / "bag"
    joints = write_viewed_bag(path, duration_s=6.0, bodies=("subject",))
    return path, joints


@pytest.fixture(scope="module")
def recorded(recording):
    with open_bag(recording[0]) as bag:
        return Recorded(bag)


def test_a_snapshot_holds_what_was_there_at_its_time(recording, recorded):
    snapshot = recorded.snapshot(2.01)

    assert snapshot.bodies["subject"].joints == pytest.approx(recording[1][60])
    assert set(snapshot.sensors) == {"left", "right"}
    assert {name: [s.person for s in seen] for name, seen in snapshot.raw.items()} == {
        "left": ["1"],
        "right": ["1"],
    }
    raw, T = snapshot.raw["left"][0].positions, snapshot.sensors["left"]
    assert raw @ T[:3, :3].T + T[:3, 3] == pytest.approx(recording[1][60], abs=1e-6)


def test_a_graph_in_a_namespace_is_shown_alike(recording, recorded, tmp_path):
    path = tmp_path / "bag"
    with open_bag(recording[0]) as bag, BagWriter(path) as writer:
        for topic in bag.topics.values():
            writer.add_topic(f"/operator_1{topic.name}", topic.msgtype, latched=topic.latched)
        for message in bag.messages():
            content = bag.deserialize(message)
            writer.write(f"/operator_1{message.topic}", content, message.stamp_ns)
    with open_bag(path) as bag:
        snapshot = Recorded(bag).snapshot(2.01)

    same = recorded.snapshot(2.01)
    body = snapshot.bodies["subject"]
    assert body.joints == pytest.approx(same.bodies["subject"].joints)
    assert set(body.rotations) == set(same.bodies["subject"].rotations)
    assert set(snapshot.sensors) == {"left", "right"}


def test_old_data_are_not_shown(recorded):
    assert recorded.snapshot(recorded.duration_s + 2.0).bodies == {}


def test_a_track_is_the_requested_interval(recorded):
    track = recorded.track("subject", 1.0, 2.0)

    assert track.times_s[0] == pytest.approx(1.0, abs=0.04)
    assert track.times_s[-1] == pytest.approx(2.0, abs=0.04)
    assert len(recorded.track("nobody", 0.0, 9.0).times_s) == 0


def test_a_joint_is_occluded_while_the_first_camera_does_not_track_it(recording, tmp_path):
    path, hand = tmp_path / "bag", JOINT_INDEX["right_hand"]
    with open_bag(recording[0]) as bag, BagWriter(path) as writer:
        for message in bag.messages():
            content = bag.deserialize(message)
            time_s = (message.stamp_ns - bag.start_ns) * 1e-9
            if message.topic == "/kinect_left/skeletons":
                if 4.0 < time_s < 5.0:
                    continue
                if 2.0 < time_s < 3.0:
                    state = content.skeletons[0].tracking_state.copy()
                    state[hand] = TrackingState.INFERRED
                    content.skeletons[0].tracking_state = state
            writer.write(message.topic, content, message.stamp_ns)
    with open_bag(path) as bag:
        track = Recorded(bag).track("subject", 0.0, 6.0)

    def found(begin_s, end_s):
        is_inside = (track.times_s > begin_s) & (track.times_s < end_s)
        return track.is_occluded[is_inside].all(axis=0), track.is_occluded[is_inside].any(axis=0)

    assert [np.flatnonzero(each).tolist() for each in found(2.1, 2.9)] == [[hand], [hand]]
    assert found(4.4, 4.9)[0].all()
    assert not found(0.1, 1.9)[1].any()


def test_bodies_that_were_not_recorded_can_be_computed(recording, recorded, monkeypatch):
    monkeypatch.setattr(BagFrames, "left_out", ("IMU torso: 5 samples left out",))
    with open_bag(recording[0]) as bag:
        missing = missing_bodies(recorded, BODIES, bag)
        extrinsics = extrinsics_from_map(recorded.sensors)
        fusion = PipelineParameters(sensors=extrinsics.sensors, subject="subject_kinect")
        computed, uses, left_out = compute_bodies(
            bag, "kinect", fusion, extrinsics, lambda share: None
        )

    assert uses == ()  # there are no IMUs in it
    assert left_out == ["IMU torso: 5 samples left out"]
    assert missing == {"subject_kinect": "kinect"}
    snapshots = computed["subject_kinect"]
    assert len(snapshots) > 60
    last = snapshots[-1]
    assert np.isfinite(last.joints).all()
    true = recording[1][round((last.stamp_ns - recorded.start_ns) * 30e-9)]
    assert np.linalg.norm(last.joints - true, axis=1).mean() < 0.2


def test_a_bag_without_data_to_show_is_refused_with_the_expected_topics(tmp_path):
    with BagWriter(tmp_path / "empty") as writer:
        String = writer.typestore.types["std_msgs/msg/String"]
        writer.write("/chatter", String(data="hello"), 1)

    with open_bag(tmp_path / "empty") as bag, pytest.raises(InputError, match="expected /humans"):
        Recorded(bag)
