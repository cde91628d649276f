"""The IMUs' calibration with the running sensors, and the fusion that is given its file."""

import numpy as np
import pytest
from pose_msgs.msg import SkeletonArray
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sample_messages import skeleton_message
from sensor_msgs.msg import Imu, TimeReference
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples
from tf2_msgs.msg import TFMessage
from worn_imus import imu_samples, merged, moving_wearer

from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_calibration.imus.section import save_alignments
from pose_core.errors import InputError
from pose_core.fusion.pipeline import Pipeline
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.streams.clocks import Clock
from pose_core.streams.samples import SkeletonSample
from pose_fusion.conversions import to_clock_messages, to_static_tf
from pose_fusion.nodes.fusion import FusionNode
from pose_fusion.nodes.live_imu_calibration import ImuCalibrationNode
from pose_node.conversions import to_header

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MOUNTING = SensorToSegment(R_sensor_segment=np.eye(3), stddev=np.full(3, 0.03))


@pytest.fixture
def session_file(tmp_path):
    path = tmp_path / "session.yaml"
    save_extrinsics(path, extrinsics())
    save_alignments(path, {"left_thigh": MOUNTING})
    return path


def imu_message(sample):
    message = Imu(header=to_header(sample.stamp_ns, f"imu_{sample.segment}_link"))
    for vector, values in (
        (message.orientation, sample.orientation),
        (message.angular_velocity, sample.angular_velocity),
    ):
        for axis, value in zip("xyzw", values.tolist(), strict=False):
            setattr(vector, axis, value)
    message.orientation_covariance[0] = 4e-4
    return message


@pytest.mark.parametrize("parameter", ["imus_file", "extrinsics_file"])
def test_the_fusion_uses_the_alignments_of_the_sessions_file(
    ros_context, session_file, parameter, monkeypatch
):
    taken = []
    monkeypatch.setattr(Pipeline, "use_sensor_to_segment", lambda _, each: taken.append(list(each)))
    overrides = [Parameter(parameter, value=str(session_file))]
    ros_context.add(FusionNode(parameter_overrides=overrides))
    assert taken == [["left_thigh"]]


def test_a_restarted_fusion_uses_the_last_imu_alignment(ros_context, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    overrides = [Parameter("run", value="r1"), Parameter("output_rate", value=0.0)]
    node = ros_context.add(FusionNode(parameter_overrides=overrides))
    node.pipeline.use_extrinsics(extrinsics())
    _, _, skeletons, imus = moving_wearer(20.0)
    for sample in merged(skeletons, imus):
        node.pipeline.add((sample,) if isinstance(sample, SkeletonSample) else sample)
    node.keep_alignments()
    found = node.pipeline.subject.sensor_to_segment
    assert "left_thigh" in found

    taken = []
    monkeypatch.setattr(Pipeline, "use_sensor_to_segment", lambda _, each: taken.append(each))
    ros_context.add(FusionNode(parameter_overrides=overrides))
    assert set(taken[0]) == set(found)
    R, R_found = (each["left_thigh"].R_sensor_segment for each in (taken[0], found))
    assert np.allclose(R, R_found, atol=1e-5)


def test_a_damaged_section_stops_the_fusion_at_the_start(ros_context, session_file):
    text = session_file.read_text().replace("left_thigh", "left_wing")
    session_file.write_text(text)
    with pytest.raises(InputError, match="names left_wing"):
        FusionNode(parameter_overrides=[Parameter("imus_file", value=str(session_file))])


def test_the_calibration_receives_cameras_imus_and_extrinsics(ros_context):
    node = ros_context.add(ImuCalibrationNode(ImuCalibrationParameters()))
    assert "the poses of the Kinects" in node.missing
    feeder = ros_context.make_node("feeder")
    transforms = feeder.create_publisher(TFMessage, "/tf_static", LATCHED)
    placed = {sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")}
    transforms.publish(to_static_tf(placed))
    ros_context.spin_until(lambda: node.calibration is not None, what="the transforms")
    assert "no samples from the IMU of any segment" in node.missing

    t, dof = motion(1.0)
    seen = skeleton_samples(kinematics().pose(dof).positions, extrinsics())[:2]
    worn = [s for s in imu_samples(t, dof, np.random.default_rng(5)) if s.segment == "torso"][:3]
    imus = feeder.create_publisher(Imu, "imu_torso/data", qos_profile_sensor_data)
    cameras = {
        sensor: feeder.create_publisher(
            SkeletonArray, f"kinect_{sensor}/skeletons", qos_profile_sensor_data
        )
        for sensor in ("left", "right")
    }
    everybody = [imus, *cameras.values()]
    ros_context.spin_until(
        lambda: all(each.get_subscription_count() for each in everybody), what="discovery"
    )
    pipeline = node.calibration.pipeline

    def heard():
        for sample in worn:
            imus.publish(imu_message(sample))
        for sample in seen:
            cameras[sample.sensor].publish(skeleton_message(sample))
        return pipeline.imus.segments == ["torso"] and pipeline.newest_ns >= seen[-1].stamp_ns

    ros_context.spin_until(heard, what="the samples")
    assert not node.calibration.is_done


def test_a_malformed_transform_is_counted_and_a_late_clock_is_used(ros_context):
    node = ros_context.add(ImuCalibrationNode(ImuCalibrationParameters()))
    feeder = ros_context.make_node("feeder")
    transforms = feeder.create_publisher(TFMessage, "/tf_static", LATCHED)
    clocks = feeder.create_publisher(TimeReference, "clock_offsets", LATCHED)
    good = to_static_tf({sensor: extrinsics().T_map_sensor(sensor) for sensor in ("left", "right")})
    bad = to_static_tf({"left": extrinsics().T_map_sensor("left")})
    bad.transforms[0].transform.rotation.x = bad.transforms[0].transform.rotation.y = 0.0
    bad.transforms[0].transform.rotation.z = bad.transforms[0].transform.rotation.w = 0.0
    transforms.publish(bad)
    ros_context.spin_until(lambda: node.counters["malformed_transforms"] == 1, what="the bad one")
    transforms.publish(good)
    ros_context.spin_until(lambda: node.calibration is not None, what="the transforms")
    for message in to_clock_messages({"right": Clock(offset_ns=80_000_000)}, 10**18):
        clocks.publish(message)
    ros_context.spin_until(lambda: "right" in node.extrinsics.clocks, what="the clock")
    assert node.extrinsics.clocks["right"].offset_ns == 80_000_000
    assert node.calibration.pipeline.clocks == node.extrinsics.clocks
