"""Conversion of the messages of tele-operation."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion
from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from pose_core.api import FloatArray
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_node.conversions import to_header
from pose_teleop.arm_controller import ArmCommand
from pose_teleop.retargeting import NamedPoses

ROBOT_COLOR = (0.83, 0.85, 0.88)


def by_name(message: Any, values: Sequence[float]) -> dict[str, float]:
    """Values of a message's joints by their names; none if there is not one for each."""
    return dict(zip(message.name, values, strict=True)) if len(values) == len(message.name) else {}


def to_robot_position(message: JointState, joints: Sequence[str]) -> FloatArray | None:
    """A robot's joint angles [rad] in the order of ``joints``; None if one is missing or NaN."""
    known = by_name(message, message.position)
    found = np.array([known.get(joint, np.nan) for joint in joints], float)
    return found if np.isfinite(found).all() else None


def to_trajectory(command: ArmCommand, joints: Sequence[str], now_ns: int) -> JointTrajectory:
    """Convert a command to a trajectory for a joint trajectory controller; its end is at rest."""
    return JointTrajectory(
        header=to_header(now_ns),
        joint_names=list(joints),
        points=[
            JointTrajectoryPoint(
                positions=motion.position.tolist(),
                velocities=motion.velocity.tolist(),
                accelerations=motion.acceleration.tolist(),
                time_from_start=Duration(nanoseconds=round(time_s * NS_PER_S)).to_msg(),
            )
            for time_s, motion in zip(command.times_s.tolist(), command.motions, strict=True)
        ],
    )


def to_points(
    message: JointTrajectory, joints: Sequence[str]
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """A trajectory's times [s], (k,), angles [rad] and velocities [rad/s], (k, joints).

    None if it has other joints, or cannot be followed.
    """
    if set(message.joint_names) != set(joints) or not message.points:
        return None
    order = [list(message.joint_names).index(joint) for joint in joints]
    times = [nanoseconds(p.time_from_start) / NS_PER_S for p in message.points]
    position = np.array([p.positions for p in message.points], float)[:, order]
    velocity = np.array([p.velocities for p in message.points], float)[:, order]
    if not (np.diff(times) > 0.0).all() or not np.isfinite(position).all():
        return None
    return np.array(times), position, velocity


def robot_states(
    joints: Sequence[str], stamp_ns: int, position: FloatArray, velocity: FloatArray | None = None
) -> JointState:
    """Create a robot's joint states from angles [rad] and velocities [rad/s], (n,)."""
    return JointState(
        header=to_header(stamp_ns),
        name=list(joints),
        position=position.tolist(),
        velocity=[] if velocity is None else velocity.tolist(),
    )


def to_pose(position: FloatArray, xyzw: FloatArray) -> Pose:
    """Create a pose."""
    x, y, z = map(float, position)
    qx, qy, qz, qw = map(float, xyzw)
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def fill_named_poses(
    message: Any, poses: NamedPoses, names: Sequence[str], stamp_ns: int, frame: str
) -> Any:
    """Fill a message that has the fields of NVIDIA's ``NamedPoseArray``."""
    message.header = to_header(stamp_ns, frame)
    message.name = list(names)
    message.pose = [to_pose(p, q) for p, q in zip(poses.position, poses.xyzw, strict=True)]
    message.is_valid = list(poses.is_valid)
    return message


def to_robot_markers(meshes: Sequence[tuple[str, FloatArray, Any]], root: str) -> MarkerArray:
    """Create markers of a robot's meshes, each in the frame of its link."""
    red, green, blue = ROBOT_COLOR
    markers = []
    for number, (link, vertices, faces) in enumerate(meshes):
        marker = Marker(
            header=Header(frame_id=f"{root}/{link}"),
            ns=root,
            id=number,
            type=Marker.TRIANGLE_LIST,
            frame_locked=True,
            color=ColorRGBA(r=red, g=green, b=blue, a=1.0),
        )
        marker.pose.orientation.w = marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        corners = np.round(vertices[faces].reshape(-1, 3), 4).tolist()
        marker.points = [Point(x=x, y=y, z=z) for x, y, z in corners]
        markers.append(marker)
    return MarkerArray(markers=markers)
