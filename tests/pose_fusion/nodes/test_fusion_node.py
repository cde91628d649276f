import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from patience import PATIENCE_S
from pose_msgs.msg import PoseEstimate, Skeleton, SkeletonArray
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sample_messages import skeleton_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from synthetic_body import SHAPE, extrinsics, kinematics, motion, skeleton_samples
from tf2_msgs.msg import TFMessage

from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_core.body.model import load_body_model
from pose_core.errors import InputError, ParameterError
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINTS
from pose_core.stamps import nanoseconds
from pose_fusion.conversions import to_static_tf
from pose_fusion.nodes import fusion as fusion_module
from pose_fusion.nodes.fusion import FusionNode

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BODY = "/humans/bodies/subject"
FRAME_S = 0.01  # [s] between two frames, of the two cameras in turn


@pytest.fixture
def make_fusion(ros_context):
    """Makes the node with the given parameters."""

    def make(**values):
        # By default each frame gives its message, so that nothing depends on the machine's pace.
        values = {"output_rate": 0.0, **values}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        node = FusionNode(parameter_overrides=overrides)
        return ros_context.add(node)

    return make


@pytest.fixture
def make_placed_fusion(make_fusion, tmp_path):
    """The same, with extrinsics from a file."""
    path = tmp_path / "extrinsics.yaml"
    save_extrinsics(path, extrinsics())
    return partial(make_fusion, extrinsics_file=str(path))


@pytest.fixture
def feed(ros_context):
    """Publishes samples one by one, each only when the node has taken the one before."""
    node = ros_context.make_node("feeder")
    publishers = {
        sensor: node.create_publisher(
            SkeletonArray, f"kinect_{sensor}/skeletons", qos_profile_sensor_data
        )
        for sensor in ("left", "right")
    }

    def publish(fusion, samples):
        ros_context.spin_until(
            lambda: all(p.get_subscription_count() for p in publishers.values()), what="discovery"
        )
        for sample in samples:
            before = fusion.pipeline.frames
            publishers[sample.sensor].publish(skeleton_message(sample))
            ros_context.spin_until(lambda b=before: fusion.pipeline.frames > b, what="a sample")

    return publish


@pytest.fixture
def patient(monkeypatch):
    """A node made from now on waits for the other sensor's frame, however slow the machine is."""
    monkeypatch.setattr("pose_fusion.nodes.fusion.REORDER_TIMEOUT_S", PATIENCE_S)


@pytest.fixture(scope="module")
def samples():
    _, dof = motion(4.0)
    positions = kinematics().pose(dof).positions
    return skeleton_samples(positions, extrinsics(), np.random.default_rng(40), 0.005)


def test_live_output_is_identical_to_offline_output(
    ros_context, patient, make_placed_fusion, feed, samples
):
    fusion = make_placed_fusion()
    states = ros_context.collect(JointState, f"{BODY}/joint_states", 1000)
    estimates = ros_context.collect(PoseEstimate, f"{BODY}/estimate", 1000)
    skeletons = ros_context.collect(Skeleton, f"{BODY}/skeleton", 1000)
    frames = ros_context.collect(TFMessage, "/tf", 1000)
    urdfs = ros_context.collect(String, f"{BODY}/urdf", LATCHED)
    feed(fusion, samples)

    pipeline = Pipeline(PipelineParameters(output_rate=0.0), fusion.pipeline.extrinsics)
    offline = [e for sample in samples for e in pipeline.add(sample)]
    ros_context.spin_until(lambda: len(states) == len(offline), what="all joint states")
    ros_context.spin_until(lambda: len(estimates) == len(skeletons) == len(states))
    for state, estimate, expected in zip(states, estimates, offline, strict=True):
        assert nanoseconds(state.header.stamp) == expected.stamp_ns
        assert list(state.name) == list(load_body_model("default").angle_names)
        np.testing.assert_array_equal(state.position, expected.position[6:])
        np.testing.assert_array_equal(state.velocity, expected.velocity[6:])
        np.testing.assert_array_equal(estimate.position_stddev, expected.position_stddev)
    assert skeletons[-1].header.frame_id == "map"
    assert list(skeletons[-1].name) == list(JOINTS)
    by_child = {t.child_frame_id: t.header.frame_id for t in frames[-1].transforms}
    assert by_child["body_subject"] == "map"
    assert by_child["left_shank_subject"] == "body_subject"
    ros_context.spin_until(lambda: urdfs, what="the URDF")
    assert "left_knee_flexion" in urdfs[0].data


def test_joint_states_are_in_order_of_stamps_whichever_sensor_arrives_first(
    ros_context, patient, make_placed_fusion, feed
):
    fusion = make_placed_fusion()
    states = ros_context.collect(JointState, f"{BODY}/joint_states", 1000)
    _, dof = motion(4.0)
    seen = skeleton_samples(kinematics().pose(dof).positions, extrinsics(), phase=0.01)
    rng = np.random.default_rng(41)
    pairs = [seen[k : k + 2] for k in range(0, len(seen), 2)]
    feed(fusion, [pair[i] for pair in pairs for i in rng.permutation(2)])
    counts = fusion.pipeline.subject.counters
    told = len(seen) - counts["frames_measuring_the_body"]
    ros_context.spin_until(lambda: len(states) >= told - 1, what="a joint state of each frame")
    stamps = [nanoseconds(state.header.stamp) for state in states]
    assert stamps == sorted(stamps)
    assert counts["frames_late_but_used"] == 0


def test_a_frame_is_used_if_the_other_sensors_frame_is_missing(
    ros_context, make_placed_fusion, feed
):
    fusion = make_placed_fusion()
    states = ros_context.collect(JointState, f"{BODY}/joint_states", 1000)
    _, dof = motion(4.0)
    seen = skeleton_samples(kinematics().pose(dof).positions, extrinsics(), phase=0.01)
    feed(fusion, seen[:-1])  # the last of the right one has been lost
    last = seen[-2].stamp_ns
    ros_context.spin_until(
        lambda: states and nanoseconds(states[-1].header.stamp) == last, what="the last frame's"
    )


def stamped_now(fusion, samples):
    """The samples, each as if it had been captured just now; not faster than any camera."""
    for sample in samples:
        time.sleep(FRAME_S)
        yield replace(sample, stamp_ns=fusion.get_clock().now().nanoseconds - 20_000_000)


def test_the_pose_predicted_to_now_is_published_at_the_output_rate(
    ros_context, make_placed_fusion, feed
):
    fusion = make_placed_fusion(output_rate=100.0, forget_after=60.0)
    fusion.pipeline.use_shape(SHAPE)
    states = ros_context.collect(JointState, f"{BODY}/joint_states", 1000)
    heard_ns = []
    node = ros_context.make_node("clock")
    node.create_subscription(
        JointState,
        f"{BODY}/joint_states",
        lambda message: heard_ns.append(
            node.get_clock().now().nanoseconds - nanoseconds(message.header.stamp)
        ),
        10,
    )
    _, dof = motion(1.0)
    still = np.tile(dof[:1], (20, 1))
    seen = skeleton_samples(kinematics().pose(still).positions, extrinsics())
    feed(fusion, stamped_now(fusion, seen))
    ros_context.spin_until(lambda: len(states) > 30, what="messages")
    stamps = [nanoseconds(state.header.stamp) for state in states]
    steps = np.diff(stamps)
    assert (steps > 0).all()
    assert (steps % 10_000_000 == 0).all()
    assert min(heard_ns) >= 0


def test_a_camera_with_stamps_a_year_ahead_is_rejected_and_reported(
    ros_context, make_placed_fusion, feed
):
    fusion = make_placed_fusion(output_rate=100.0)
    fusion.pipeline.use_shape(SHAPE)
    reports = ros_context.collect(DiagnosticArray, "/diagnostics", 10)
    _, dof = motion(1.0)
    seen = skeleton_samples(kinematics().pose(dof).positions, extrinsics())
    year_ns = 365 * 86_400 * 10**9
    node = ros_context.make_node("ahead")
    publisher = node.create_publisher(
        SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data
    )
    ros_context.spin_until(publisher.get_subscription_count, what="discovery")
    for sample in [each for each in seen if each.sensor == "left"][:5]:
        now_ns = fusion.get_clock().now().nanoseconds
        publisher.publish(skeleton_message(replace(sample, stamp_ns=now_ns + year_ns)))
    said = "left is not used: its stamps are"
    ros_context.spin_until(
        lambda: any(said in s.message for r in reports for s in r.status), what="its name"
    )
    assert fusion.pipeline.skeletons == 0


def test_imu_samples_are_processed_without_frames(ros_context, make_fusion, feed, samples):
    fusion = make_fusion()
    node = ros_context.make_node("imus")
    publisher = node.create_publisher(Imu, "imu_torso/data", qos_profile_sensor_data)
    ros_context.spin_until(publisher.get_subscription_count, what="discovery")
    message = Imu()
    message.orientation.w = 1.0
    for k in range(30):
        message.header.stamp.nanosec = k * 10_000_000
        publisher.publish(message)
    ros_context.spin_until(lambda: fusion.pipeline.imu_samples == 30, what="the IMU's samples")


def test_extrinsics_can_be_set_later_by_static_transforms(ros_context, make_fusion, feed, samples):
    fusion = make_fusion()
    states = ros_context.collect(JointState, f"{BODY}/joint_states", 1000)
    feed(fusion, samples[:20])
    assert fusion.pipeline.people_counts["frames_before_extrinsics"] == 20
    node = ros_context.make_node("calibrated")
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    node.create_publisher(TFMessage, "/tf_static", LATCHED).publish(to_static_tf(placed))
    ros_context.spin_until(lambda: fusion.pipeline.extrinsics is not None, what="extrinsics")
    feed(fusion, samples[20:])
    ros_context.spin_until(lambda: states, what="joint states")


def test_a_malformed_skeleton_is_counted_in_diagnostics(ros_context, make_fusion, feed, samples):
    make_fusion()
    reports = ros_context.collect(DiagnosticArray, "/diagnostics", 10)
    node = ros_context.make_node("broken")
    publisher = node.create_publisher(
        SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data
    )
    message = skeleton_message(samples[0])
    message.skeletons[0].position.pop()
    ros_context.spin_until(publisher.get_subscription_count, what="discovery")
    publisher.publish(message)

    def reported():
        own = [s for r in reports for s in r.status if s.name == "/fusion"]
        values = {v.key: v.value for v in own[-1].values} if own else {}
        return values.get("malformed_skeletons") == "1"

    ros_context.spin_until(reported, what="the count")


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        ({"extrinsics_file": "/nowhere.yaml"}, InputError, "/nowhere.yaml"),
        ({"tuning": "/nowhere.yaml"}, InputError, "/nowhere.yaml"),
        ({"forget_after": -1.0}, ParameterError, "forget_after"),
        ({"estimator": "magic"}, ParameterError, "'magic' is not one of"),
    ],
)
def test_a_bad_parameter_stops_the_node_with_one_line(ros_context, values, error, message):
    with pytest.raises(error, match=message) as caught:
        FusionNode(parameter_overrides=[Parameter(k, value=v) for k, v in values.items()])
    assert "\n" not in str(caught.value)


def test_an_unused_camera_is_reported(make_placed_fusion, ros_context, spin_until):
    back = ros_context.make_node("back")
    back.create_publisher(SkeletonArray, "kinect_back/skeletons", qos_profile_sensor_data)
    diagnostics = ros_context.collect(DiagnosticArray, "/diagnostics")
    make_placed_fusion()

    def says_so() -> bool:
        return any("not used: back" in message.status[0].message for message in diagnostics)

    spin_until(says_so, what="the sensor's name")


@pytest.mark.parametrize(
    ("topic", "use_imus", "remark"),
    [
        ("imu_leftthigh/data", True, "IMUs not used: /imu_leftthigh/data: expected imu_<segment>"),
        ("imu_left_thigh/data", False, "IMUs not used: head, left_thigh: use_imus is false"),
    ],
)
def test_a_published_imu_that_is_not_read_is_reported(
    make_placed_fusion, ros_context, topic, use_imus, remark
):
    driver = ros_context.make_node("driver")
    driver.create_publisher(Imu, topic, qos_profile_sensor_data)
    driver.create_publisher(Imu, "imu_head/data_raw", qos_profile_sensor_data)
    driver.create_publisher(Imu, "imu_head/data", qos_profile_sensor_data)
    diagnostics = ros_context.collect(DiagnosticArray, "/diagnostics")
    make_placed_fusion(use_imus=use_imus)

    def says_so() -> bool:
        return any(remark in message.status[0].message for message in diagnostics)

    ros_context.spin_until(says_so, what="the IMU's name")
    if use_imus:
        assert "imu_head/data_raw" not in diagnostics[-1].status[0].message


CHECKED = 40  # samples between two checks


class Log:
    """Keeps a node's lines, each with its level."""

    def __init__(self):
        self.lines = []

    def info(self, text, **_):
        self.lines.append(("info", text))

    def warning(self, text, **_):
        self.lines.append(("warning", text))


def test_a_camera_that_is_lost_and_comes_back_is_logged_once_each(make_placed_fusion, monkeypatch):
    log = Log()
    monkeypatch.setattr(FusionNode, "get_logger", lambda _: log)
    monkeypatch.setattr(fusion_module, "LOG_PERIOD_S", 0.0)
    node = make_placed_fusion(use_imus=False)
    _, dof = motion(12.0)
    rng = np.random.default_rng(3)
    samples = skeleton_samples(kinematics().pose(dof).positions, extrinsics(), rng, 0.005)
    log.lines.clear()
    for begin in range(0, len(samples), CHECKED):
        for sample in samples[begin : begin + CHECKED]:
            if sample.sensor == "left" or not 0.5 < begin / len(samples) < 0.75:
                node.pipeline.add([sample])
        node._check_sources()
        node.report()
    told = [(level, "right does not show" in text) for level, text in log.lines]
    assert told == [("info", False), ("info", False), ("warning", True), ("info", False)]
    assert "measuring the body" in log.lines[0][1]
