"""The person for third-party tools: retargeters, ROS4HRI."""

from functools import partial

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from followed_person import person_urdf
from geometry_msgs.msg import TransformStamped
from pose_msgs.msg import NamedPoseArray, SkeletonArray
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from sent_frames import sent_frames
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from kinect_bridge.nodes.kinect_bridge import KinectBridge
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_teleop.nodes.bodies import LATCHED
from pose_teleop.nodes.hri import HriNode
from pose_teleop.nodes.retarget import RetargetNode

STAMP_S = 1_000


def overrides(**values):
    return [Parameter(name, value=value) for name, value in values.items()]


def tf_message():
    names, position, xyzw, joints = sent_frames(angles={"left_elbow_flexion": 0.8})
    message = TFMessage()
    for name, p, q in zip(names, position.tolist(), xyzw.tolist(), strict=True):
        each = TransformStamped(child_frame_id=name)
        each.header.stamp.sec = STAMP_S
        each.header.frame_id = "body_subject" if message.transforms else "map"
        t = each.transform
        t.translation.x, t.translation.y, t.translation.z = p
        t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w = q
        message.transforms.append(each)
    return message, joints


def send_until(ros_context, publish, condition, what=""):
    """Publish twenty times a second until the condition holds."""
    node = ros_context.make_node()
    timer = node.create_timer(0.05, publish)
    ros_context.spin_until(condition, what=what)
    timer.cancel()


@pytest.mark.parametrize("package", ["pose_msgs", "teleop_ros2_interfaces"])
def test_the_bridge_receives_the_retargeted_person(ros_context, package):
    message_type = f"{package}/msg/NamedPoseArray"
    ros_context.add(RetargetNode(parameter_overrides=overrides(message_type=message_type)))
    bridge = overrides(source="named_poses", message_type=message_type, name="back")
    ros_context.add(KinectBridge(parameter_overrides=bridge))
    heard = ros_context.collect(SkeletonArray, "kinect_back/skeletons", qos_profile_sensor_data)
    message, _ = tf_message()
    publisher = ros_context.make_node().create_publisher(TFMessage, "/tf", 10)

    send_until(
        ros_context, partial(publisher.publish, message), lambda: heard and heard[-1].skeletons
    )

    (skeleton,) = heard[-1].skeletons
    row = skeleton.name.index("left_elbow")
    assert skeleton.tracking_state[row] == 2


def test_poses_have_smpls_names_and_the_stamp_of_the_capture(ros_context):
    ros_context.add(RetargetNode())
    heard = ros_context.collect(NamedPoseArray, "xr_teleop/full_body")
    message, joints = tf_message()
    publisher = ros_context.make_node().create_publisher(TFMessage, "/tf", 10)

    send_until(ros_context, partial(publisher.publish, message), lambda: heard)

    found = heard[-1]
    assert (found.header.stamp.sec, found.header.frame_id) == (STAMP_S, "map")
    at = found.pose[found.name.index("left_wrist")].position
    assert at.z == pytest.approx(joints[JOINT_INDEX["left_hand"], 2], abs=1e-6)


def test_a_type_that_is_not_installed_is_named(ros_context):
    with pytest.raises(InputError, match="apt install ros-jazzy-nobody-msgs"):
        RetargetNode(parameter_overrides=overrides(message_type="nobody_msgs/msg/Poses"))


def test_rep_155s_tools_find_the_person(ros_context):
    from hri_msgs.msg import IdsList

    ros_context.add(HriNode(parameter_overrides=overrides(timeout=0.5)))
    node = ros_context.make_node()
    latched = QoSProfile(depth=1, durability=LATCHED.durability)
    tracked = ros_context.collect(IdsList, "/humans/bodies/tracked", latched)
    states = ros_context.collect(JointState, "/humans/bodies/person/joint_states")
    urdf = ros_context.collect(String, "/humans/bodies/person/urdf", latched)
    tf = ros_context.collect(TFMessage, "/tf")
    node.create_publisher(String, "/humans/bodies/subject/urdf", latched).publish(
        String(data=person_urdf())
    )
    publisher = node.create_publisher(JointState, "/humans/bodies/subject/joint_states", 10)
    frames = node.create_publisher(TFMessage, "/tf", 10)
    names = ["neck_flexion", "neck_lateral_bending", "waist_flexion"]
    for side in ("left", "right"):
        for joint in ("shoulder", "hip"):
            names += [f"{side}_{joint}_{a}" for a in ("flexion", "abduction", "rotation")]
        names += [f"{side}_elbow_flexion", f"{side}_knee_flexion"]
    state = JointState(name=names, position=[0.2] * len(names))

    message, _ = tf_message()

    def publish():
        frames.publish(message)
        publisher.publish(state)

    def has_root():
        return any(m.transforms[0].child_frame_id == "body_person" for m in tf[-20:])

    def is_tracked():
        return any(list(m.ids) == ["person"] for m in tracked)

    send_until(
        ros_context,
        publish,
        lambda: states and urdf and has_root() and is_tracked(),
        "joint states, tree, root frame and the list of bodies",
    )
    assert "l_knee_person" in states[-1].name
    assert states[-1].position[states[-1].name.index("l_knee_person")] == pytest.approx(-0.2)
    assert "l_wrist_person" in urdf[-1].data
    ros_context.spin_until(lambda: not tracked[-1].ids, what="a list without the person")

    told = ros_context.collect(DiagnosticArray, "/diagnostics")
    state.position.pop()

    def is_told():
        statuses = [status for message in told for status in message.status]
        return any("lack a position of 'right_knee_flexion'" in each.message for each in statuses)

    send_until(ros_context, publish, is_told, "diagnostics that name the missing position")
