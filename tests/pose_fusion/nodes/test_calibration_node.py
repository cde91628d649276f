"""The calibration node on a graph."""

from dataclasses import replace

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from pose_msgs.msg import SkeletonArray
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sample_messages import skeleton_message
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from walking_person import LEFT, POSES, RIGHT, angle_deg, samples

from pose_calibration.body_measures import measure_body
from pose_calibration.files.extrinsics_file import load_extrinsics, save_extrinsics
from pose_core.errors import InputError, ParameterError
from pose_core.joints import JOINTS
from pose_core.session.extrinsics import extrinsics_from_map
from pose_core.transforms import inverse
from pose_fusion.conversions import to_static_tf
from pose_fusion.nodes.calibration import CalibrationNode
from pose_io.static_transforms import transforms_to_map
from pose_node.kept import kept_file

TRUE = inverse(LEFT) @ RIGHT
LATCHED = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


AT_ONCE = 6  # [samples] of both sensors; fewer than a publisher keeps


def batched(some, size):
    """Lists of so many."""
    return [some[first : first + size] for first in range(0, len(some), size)]


@pytest.fixture
def graph(ros_context):
    """Start the node with parameters; returns it with what it publishes."""

    class Graph:
        def __init__(self):
            self.tester = ros_context.make_node("tester")
            self.spin_until = ros_context.spin_until
            self.publishers = {
                name: self.tester.create_publisher(
                    SkeletonArray, f"kinect_{name}/skeletons", qos_profile_sensor_data
                )
                for name in POSES
            }

        def start(self, **parameters):
            overrides = [Parameter(name, value=value) for name, value in parameters.items()]
            self.node = ros_context.add(CalibrationNode(parameter_overrides=overrides))
            return self.node

        def listen(self):
            """Subscribe, perhaps long after the node has published."""
            self.tf = ros_context.collect(TFMessage, "/tf_static", LATCHED)
            self.extrinsics = ros_context.collect(TransformStamped, "extrinsics", LATCHED)
            self.diagnostics = ros_context.collect(DiagnosticArray, "/diagnostics")

        def play(self, some, until=lambda: False):
            """Publish samples, a few at once, each lot when the one before has arrived."""
            for publisher in self.publishers.values():
                self.spin_until(lambda p=publisher: p.get_subscription_count(), what="the node")
            for group in batched(some, AT_ONCE):
                received = self.node.calibration.selector.counters
                wanted = sum(received.as_dict().values()) + len(group)
                for one in group:
                    self.publishers[one.sensor].publish(skeleton_message(one))
                self.spin_until(
                    lambda n=wanted, r=received: (
                        sum(r.as_dict().values()) >= n
                        or self.node._counters["malformed_frames"]
                        or self.node.calibration.state.value in ("refined", "loaded")
                    ),
                    what="skeletons to arrive",
                )
                if until():
                    return

        def call(self, service):
            client = self.tester.create_client(Trigger, f"calibration/{service}")
            self.spin_until(client.service_is_ready, what=service)
            future = client.call_async(Trigger.Request())
            self.spin_until(future.done, what=f"the answer of {service}")
            return future.result()

    return Graph()


def test_a_walking_person_gives_latched_transforms(graph):
    graph.start(collect_duration=5.0)
    graph.play(samples(duration_s=6.0), until=lambda: graph.node.calibration.extrinsics)
    graph.listen()
    graph.spin_until(lambda: graph.tf and graph.extrinsics, what="the calibration")

    (tf,) = graph.tf
    assert [t.header.frame_id for t in tf.transforms] == ["map", "map"]
    assert {t.child_frame_id for t in tf.transforms} == {
        "kinect_left_optical_frame",
        "kinect_right_optical_frame",
    }
    placed = transforms_to_map(tf.transforms)
    assert angle_deg(inverse(placed["left"]) @ placed["right"], TRUE) < 0.6
    assert placed["left"][2, 3] == pytest.approx(LEFT[2, 3], abs=0.05)
    (extrinsics,) = graph.extrinsics
    assert extrinsics.header.frame_id == "kinect_left_optical_frame"
    assert extrinsics.child_frame_id == "kinect_right_optical_frame"
    assert extrinsics.transform.translation.x == pytest.approx(TRUE[0, 3], abs=0.03)


def given_poses(graph, moved_m=0.0):
    """Publish poses on /tf_static, as another node does; they are returned."""
    poses = {name: T.copy() for name, T in POSES.items()}
    for T in poses.values():
        T[0, 3] += moved_m
    publisher = graph.tester.create_publisher(TFMessage, "/tf_static", LATCHED)
    publisher.publish(to_static_tf(poses))
    return poses


def test_poses_that_another_node_publishes_are_kept(graph):
    poses = given_poses(graph, moved_m=0.4)
    graph.start()
    graph.spin_until(lambda: graph.node.calibration.extrinsics, what="the poses")
    assert graph.node.calibration.status == "loaded"
    graph.play(samples(duration_s=5.0))
    found = graph.node.calibration.extrinsics
    for name, T in poses.items():
        np.testing.assert_allclose(found.T_map_sensor(name), T, atol=1e-6)
    graph.listen()
    graph.spin_until(lambda: graph.extrinsics, what="the extrinsics")
    translation = graph.extrinsics[0].transform.translation
    assert translation.x == pytest.approx(TRUE[0, 3], abs=1e-6)


def test_poses_of_another_node_are_not_kept_if_not_wanted(graph):
    given_poses(graph, moved_m=0.4)
    graph.start(keep_given=False, collect_duration=5.0)
    graph.play(samples(duration_s=6.0), until=lambda: graph.node.calibration.extrinsics)
    assert graph.node.calibration.status != "loaded"


def values_of(graph):
    """What the node has said last of itself."""
    (status,) = graph.diagnostics[-1].status
    return {value.key: value.value for value in status.values}


def test_missing_inputs_are_reported_in_diagnostics(graph):
    graph.start()
    graph.listen()
    graph.play([one for one in samples(duration_s=0.5) if one.sensor == "left"])
    graph.node.diagnostics.publish()
    graph.spin_until(
        lambda: graph.diagnostics and values_of(graph)["alignment/received"] == "15",
        what="diagnostics of all 15 frames",
    )
    (status,) = graph.diagnostics[-1].status
    assert status.name == "/calibration"
    assert status.level == b"\x01"
    assert status.message == "collecting: no skeletons from right yet"
    values = values_of(graph)
    assert values["person/held_frames"] == "0"


def test_a_new_calibration_is_saved(graph, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    graph.start(file=str(path))
    graph.play(samples(duration_s=6.0), until=path.exists)
    assert angle_deg(load_extrinsics(path).T_reference_sensor["right"], TRUE) < 0.6


def test_a_saved_calibration_is_published_at_once(graph, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics_from_map(POSES))
    graph.start(file=str(path))
    graph.listen()
    graph.spin_until(lambda: graph.tf and graph.extrinsics, what="the loaded calibration")
    placed = transforms_to_map(graph.tf[0].transforms)
    np.testing.assert_allclose(placed["right"], RIGHT, atol=1e-5)


def test_the_service_calibrate_restarts_the_calibration(graph, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics_from_map({name: np.eye(4) for name in POSES}))
    graph.start(file=str(path))
    assert graph.call("calibrate").success
    graph.play(samples(duration_s=6.0), until=lambda: graph.node.calibration.counts["solutions"])
    assert angle_deg(load_extrinsics(path).T_reference_sensor["right"], TRUE) < 0.6


@pytest.mark.parametrize("is_final", [True, False])
def test_a_restarted_calibration_keeps_a_final_result_and_improves_another(
    graph, monkeypatch, tmp_path, is_final
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    body = measure_body(samples(duration_s=2.0)) if is_final else None
    save_extrinsics(kept_file("/calibration", "r1"), replace(extrinsics_from_map(POSES), body=body))
    calibration = graph.start(run="r1").calibration
    assert calibration.is_finished == is_final
    np.testing.assert_allclose(calibration.extrinsics.T_map_sensor("right"), RIGHT, atol=1e-5)


def test_the_service_save_writes_the_current_calibration(graph, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics_from_map(POSES))
    graph.start(file=str(path))
    path.unlink()
    answer = graph.call("save")
    assert (answer.success, answer.message) == (True, f"saved {path}")
    assert path.exists()


def test_the_service_save_reports_a_missing_calibration(graph, tmp_path):
    graph.start(file=str(tmp_path / "extrinsics.yaml"))
    answer = graph.call("save")
    assert not answer.success
    assert answer.message.startswith("nothing to save yet: collecting")


def test_the_service_save_reports_a_missing_file_name(graph):
    graph.start()
    assert "start the node with the parameter 'file'" in graph.call("save").message


def test_a_malformed_skeleton_is_counted(graph):
    graph.start()
    (one,) = samples(duration_s=0.05)[:1]
    broken = skeleton_message(one, names=JOINTS[:3])
    publisher = graph.publishers[one.sensor]
    graph.spin_until(publisher.get_subscription_count, what="the node")
    publisher.publish(broken)
    graph.spin_until(lambda: graph.node._counters["malformed_frames"], what="the count")


def test_a_file_of_other_sensors_stops_the_node(graph, tmp_path):
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics_from_map(POSES))
    with pytest.raises(InputError, match="calibration of left, right"):
        graph.start(file=str(path), sensors=["left", "middle"])


def test_a_bad_parameter_stops_the_node(graph):
    with pytest.raises(ParameterError, match="minimum_duration"):
        graph.start(minimum_duration=-1.0)
