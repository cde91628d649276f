"""State collected from a live graph's messages."""

from types import SimpleNamespace

import numpy as np
import pytest
from pose_msgs.msg import SkeletonArray
from viewed_bag import FRAME_NS, START_NS, moving_joints, skeleton_message

from pose_node.conversions import to_header
from pose_node.node_status import NodeStatus
from pose_view.live import LiveGraph

JOINTS = moving_joints(1.0)
S = 1_000_000_000


@pytest.fixture
def graph():
    return LiveGraph({"subject": "Fused"}, ["left"], span_s=10.0)


def feed(graph, stamps_ns):
    for stamp_ns in stamps_ns:
        message = skeleton_message(JOINTS[0], to_header(stamp_ns, "map"), "subject")
        graph.add_skeleton("subject", message)


def times_s(graph):
    return graph.track("subject", 0.0, 1e12).times_s.tolist()


def test_a_late_skeleton_is_left_out_and_counted(graph):
    times = [START_NS + k * FRAME_NS for k in range(20)]
    feed(graph, [*times[:10], times[4], *times[10:]])

    assert times_s(graph) == [stamp_ns * 1e-9 for stamp_ns in times]
    assert graph.counters["late_skeletons"] == 1


def test_a_recording_that_begins_anew_begins_new_curves(graph):
    first = [START_NS + 60 * S + k * FRAME_NS for k in range(5)]
    again = [START_NS + k * FRAME_NS for k in range(5)]
    feed(graph, [*first, *again])

    assert times_s(graph) == [stamp_ns * 1e-9 for stamp_ns in again]


def test_no_more_is_kept_than_the_plots_show(graph):
    feed(graph, [START_NS + k * S // 10 for k in range(600)])

    assert len(times_s(graph)) == pytest.approx(111, abs=2)


def test_a_joint_that_the_first_camera_does_not_track_is_occluded(graph):
    def occluded(stamp_ns):
        feed(graph, [stamp_ns])
        return graph.snapshot(stamp_ns).bodies["subject"].is_occluded

    assert occluded(START_NS) is None  # no frame of the camera yet
    header = to_header(START_NS + FRAME_NS, "kinect_left_optical_frame")
    seen = skeleton_message(JOINTS[0], header, "1")
    seen.tracking_state[3] = 1
    graph.add_raw("left", SkeletonArray(header=header, skeletons=[seen]), START_NS)

    assert np.flatnonzero(occluded(START_NS + 2 * FRAME_NS)).tolist() == [3]
    assert occluded(START_NS + S).all()  # the camera is silent


def test_a_malformed_skeleton_is_counted(graph):
    message = skeleton_message(JOINTS[0], to_header(START_NS, "map"), "subject")
    message.name = ["head"]
    graph.add_skeleton("subject", message)

    assert times_s(graph) == []
    assert graph.counters["malformed_skeletons"] == 1


def test_the_bag_is_read_from_the_recorders_report(graph):
    assert graph.bag() is None
    graph.add_report(NodeStatus(name="/recorder", message="not recording", values={"bag": ""}))
    assert graph.bag() == ""
    graph.add_report(NodeStatus(name="/recorder", message="recording", values={"bag": "out/b"}))
    assert graph.bag() == "out/b"
    assert any("recording" in line.text for line in graph.lines(S))


def test_a_body_without_messages_for_a_second_is_not_shown(graph):
    feed(graph, [START_NS])
    graph.note_skeleton("subject", START_NS, START_NS)

    assert list(graph.snapshot(START_NS + S // 2).bodies) == ["subject"]
    assert not graph.snapshot(START_NS + 2 * S).bodies


def joint_state(stamp_ns, joints, position):
    return SimpleNamespace(header=to_header(stamp_ns, "map"), name=joints, position=position)


def test_a_robot_that_follows_has_a_past_once_both_its_topics_have_come(graph):
    graph.robot_asked.add(joint_state(START_NS, ["elbow"], [0.5]))
    assert graph.robot_tracks() is None

    for k in range(300):
        graph.robot_joints.add(joint_state(START_NS + k * S // 10, ["elbow"], [0.1 * k]))

    asked, measured = graph.robot_tracks()
    assert asked.position.tolist() == [[0.5]]
    assert len(measured.times_s) == pytest.approx(111, abs=2)


def test_another_robot_begins_a_new_past(graph):
    graph.robot_asked.add(joint_state(START_NS, ["elbow"], [0.5]))
    for joints in (["elbow"], ["wrist"]):
        graph.robot_joints.add(joint_state(START_NS, joints, [0.1]))

    assert graph.robot_tracks()[1].joints == ("wrist",)
    assert len(graph.robot_tracks()[1].times_s) == 1
