from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from pose_msgs.msg import SkeletonArray
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data

from kinect_bridge.nodes.kinect_bridge import KinectBridge
from pose_core.errors import InputError, ParameterError
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.stamps import nanoseconds

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"
MS = 1_000_000  # [ns]
LEAD_NS = 2_000 * MS  # time for the publisher and the subscription to find each other


@pytest.fixture
def bridge(ros_context):
    """Make a bridge that begins once its subscribers are there, and collect what it sends."""

    def make(topic="kinect_left/skeletons", lead_ns=LEAD_NS, **parameters):
        node = ros_context.make_node()
        received = []
        node.create_subscription(SkeletonArray, topic, received.append, qos_profile_sensor_data)
        start_ns = node.get_clock().now().nanoseconds + lead_ns
        values = {"file": str(CSV), "start_at": str(start_ns), **parameters}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        started = ros_context.add(KinectBridge(parameter_overrides=overrides))
        return started, received, start_ns

    return make


def test_a_replayed_csv_arrives_with_stamps_frame_axes_and_states(bridge, spin_until):
    _, received, start_ns = bridge(rate=20.0)

    spin_until(lambda: len(received) == 6, what="six frames")

    stamps = [nanoseconds(message.header.stamp) for message in received]
    np.testing.assert_allclose(np.array(stamps) - start_ns, np.arange(6) * 5 * MS, atol=1000)
    for message in received:
        assert message.header.frame_id == "kinect_left_optical_frame"
        for skeleton in message.skeletons:
            assert skeleton.header == message.header
            assert skeleton.id == "anna"
            assert tuple(skeleton.name) == JOINTS
    shoulder = received[0].skeletons[0].position[JOINT_INDEX["left_shoulder"]]
    assert (shoulder.x, shoulder.y, shoulder.z) == (0.2, -0.35, 2.5)
    assert received[1].skeletons[0].tracking_state[JOINT_INDEX["left_foot"]] == 1
    hand = JOINT_INDEX["right_hand"]
    assert received[2].skeletons[0].tracking_state[hand] == 0
    assert np.isnan(received[2].skeletons[0].position[hand].x)
    assert received[3].skeletons == []


def test_all_persons_of_a_frame_are_in_one_message(bridge, spin_until):
    _, received, _ = bridge("kinect_right/skeletons", name="right", sensor="right", rate=20.0)

    spin_until(lambda: len(received) == 6, what="six frames")

    assert [[s.id for s in message.skeletons] for message in received] == [
        *[["anna"]] * 4,
        ["anna", "ben"],
        ["anna"],
    ]


def test_a_loop_goes_on_with_increasing_stamps(bridge, spin_until):
    _, received, start_ns = bridge(rate=20.0, loop=True)

    spin_until(lambda: len(received) >= 15, what="three rounds")

    stamps = np.array([nanoseconds(message.header.stamp) for message in received])
    assert (np.diff(stamps) > 0).all()
    in_round = (stamps - start_ns + 1000) % (32 * MS) - 1000  # a message may be lost on the way
    np.testing.assert_allclose(in_round, np.rint(in_round / (5 * MS)) * 5 * MS, atol=1000)
    assert stamps[-1] - start_ns > 32 * MS
    assert in_round.max() < 26 * MS


def test_a_late_replay_publishes_every_frame_and_reports_its_delay(bridge, ros_context, spin_until):
    diagnostics = ros_context.collect(DiagnosticArray, "/diagnostics")
    _, received, _ = bridge(lead_ns=-60_000 * MS, rate=1.0, loop=True)

    spin_until(lambda: len(received) >= 10, what="ten late frames")

    stamps = np.array([nanoseconds(message.header.stamp) for message in received])
    steps = np.unique(np.rint(np.diff(stamps) / MS))
    assert set(steps) <= {100.0, 140.0}  # none is missing: 140 ms from the last to the first
    spin_until(lambda: diagnostics, what="a report")
    status = diagnostics[0].status[0]
    assert status.level == DiagnosticStatus.WARN
    assert status.message.startswith("replaying a recording, ")


def test_diagnostics_have_the_progress_and_the_end(bridge, ros_context, spin_until):
    diagnostics = ros_context.collect(DiagnosticArray, "/diagnostics")
    bridge(lead_ns=0, rate=20.0)

    def status():
        return diagnostics[-1].status[0] if diagnostics else None

    spin_until(lambda: status() and status().message == "recording finished", what="the end")
    reports = len(diagnostics)
    spin_until(lambda: len(diagnostics) > reports, what="a report after the end")

    values = {value.key: value.value for value in status().values}
    assert float(values["progress"]) == 1.0
    assert values["frames_published"] == "6"
    assert values["frames_nobody_seen"] == "1"
    assert values["joints_not_tracked"] == "1"
    assert values["joints_inferred"] == "1"
    assert values["frames_repeated"] == "0"
    assert values["comment"].startswith("synthetic: ")
    assert values["clock"] == "sensor"
    assert "clock_drift_ppm" in values


@pytest.mark.parametrize(
    ("parameters", "error", "said"),
    [
        ({"file": ""}, ParameterError, "file is empty"),
        ({"file": "/no/such.csv"}, InputError, "found no file"),
        ({"sensor": "middle"}, InputError, "sensor 'middle' was asked for"),
        ({"rate": 0.0}, ParameterError, "rate"),
        ({"clock": "sundial"}, ParameterError, "sundial"),
        ({"name": "a/b"}, ParameterError, "cannot be part of a ROS name"),
        ({"start_at": "noon"}, ParameterError, "not a UNIX time"),
    ],
)
def test_a_bad_parameter_or_file_stops_the_node_at_start(bridge, parameters, error, said):
    with pytest.raises(error, match=said):
        bridge(**parameters)
