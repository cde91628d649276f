"""Conversion of estimates to messages."""

from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, TransformStamped
from pose_msgs.msg import PoseEstimate, Skeleton
from rosbags.typesys.store import Typestore
from sensor_msgs.msg import JointState, TimeReference
from std_msgs.msg import ColorRGBA, Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from pose_core.api import (
    ROOT_DOF,
    BodyEstimate,
    BodyFrames,
    BodyModel,
    Clocks,
    Extrinsics,
    FloatArray,
    is_imus,
    quaternion,
)
from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_io.names import BODIES, WORLD_FRAME, sensor_frame
from pose_node.conversions import ns_to_stamp, to_header, to_transform

BONE_WIDTH = 0.03  # [m]
MARKER_LIFETIME_S = 1  # [s] after which RViz removes a body that is published no more
JOINT_DIAMETER = 0.06  # [m]
STATE_COLORS = {  # safe for colour-blind eyes
    TrackingState.TRACKED: (0.0, 0.45, 0.70),
    TrackingState.INFERRED: (0.90, 0.62, 0.0),
    TrackingState.NOT_TRACKED: (0.6, 0.6, 0.6),
}


def body_topics(body_id: str) -> dict[str, type]:
    """Types of the topics that carry a person's estimates."""
    prefix = f"{BODIES}{body_id}"
    return {
        f"{prefix}/joint_states": JointState,
        f"{prefix}/skeleton": Skeleton,
        f"{prefix}/estimate": PoseEstimate,
        f"{prefix}/markers": MarkerArray,
        "/tf": TFMessage,
    }


def urdf_topic(body_id: str) -> str:
    """The latched topic of the person's kinematic tree."""
    return f"{BODIES}{body_id}/urdf"


def to_messages(
    estimate: BodyEstimate, model: BodyModel, body_id: str, latency_s: float
) -> dict[str, Any]:
    """All messages of one estimate by topic, those of :func:`body_topics`."""
    messages = (
        to_joint_state(estimate),
        to_skeleton(estimate, body_id),
        to_pose_estimate(estimate, body_id, latency_s),
        to_markers(estimate, model, body_id),
        to_tf(estimate, model, body_id),
    )
    return dict(zip(body_topics(body_id), messages, strict=True))


def type_name(message_type: Any) -> str:
    """For example ``pose_msgs/msg/Skeleton``."""
    package = message_type.__module__.split(".")[0]
    return f"{package}/msg/{message_type.__name__}"


def to_bag_message(message: Any, typestore: Typestore) -> Any:
    """Convert a message to the form that rosbags writes.

    ROS's own serialiser leaves padding bytes uninitialised, and the buffer longer than the message;
    rosbags always gives the same bytes for the same message.
    """
    if isinstance(message, array):
        return np.asarray(message)
    if isinstance(message, list):
        return [to_bag_message(item, typestore) for item in message]
    if not hasattr(message, "get_fields_and_field_types"):
        return message
    fields = {
        name: to_bag_message(getattr(message, name), typestore)
        for name in message.get_fields_and_field_types()
    }
    return typestore.types[type_name(type(message))](**fields)


def to_joint_state(estimate: BodyEstimate) -> JointState:
    """The joint angles and rates, without the root."""
    return JointState(
        header=to_header(estimate.stamp_ns, WORLD_FRAME),
        name=list(estimate.dof_names[ROOT_DOF:]),
        position=estimate.position[ROOT_DOF:].tolist(),
        velocity=estimate.velocity[ROOT_DOF:].tolist(),
    )


def to_skeleton(estimate: BodyEstimate, body_id: str) -> Skeleton:
    """The 15 fused joint positions in map."""
    return Skeleton(
        header=to_header(estimate.stamp_ns, WORLD_FRAME),
        id=body_id,
        name=list(JOINTS),
        position=_points(estimate.joints),
        tracking_state=estimate.tracking_state.tolist(),
    )


def to_pose_estimate(estimate: BodyEstimate, body_id: str, latency_s: float) -> PoseEstimate:
    """Every degree of freedom with its uncertainty and source; unknown ones are NaN."""
    return PoseEstimate(
        header=to_header(estimate.stamp_ns, WORLD_FRAME),
        id=body_id,
        name=list(estimate.dof_names),
        position=np.where(estimate.is_known, estimate.position, np.nan).tolist(),
        velocity=estimate.velocity.tolist(),
        position_stddev=estimate.position_stddev.tolist(),
        weight_kinect=estimate.weight_kinect.tolist(),
        weight_imu=estimate.weight_imu.tolist(),
        state=estimate.source.tolist(),
        latency=latency_s,
    )


def to_tf(estimate: BodyEstimate, model: BodyModel, body_id: str) -> TFMessage:
    """The body in map, and every frame of its URDF in the body."""
    frames = BodyFrames(model, body_id)
    instant = (estimate.T_map_link[None], estimate.position[None], estimate.fk_joints[None])
    (places,) = frames.places(*instant).tolist()
    in_map, in_body = (to_header(estimate.stamp_ns, f) for f in (WORLD_FRAME, frames.names[0]))
    transforms = [
        to_transform(in_body if index else in_map, frame, place)
        for index, (frame, place) in enumerate(zip(frames.names, places, strict=True))
    ]
    return TFMessage(transforms=transforms)


def to_markers(estimate: BodyEstimate, model: BodyModel, body_id: str) -> MarkerArray:
    """Bones as lines and joints as balls, coloured by tracking state."""
    header = to_header(estimate.stamp_ns, WORLD_FRAME)
    bones = Marker(header=header, ns=body_id, id=0, type=Marker.LINE_LIST)
    bones.scale.x = BONE_WIDTH
    bones.color = ColorRGBA(r=0.8, g=0.8, b=0.8, a=1.0)
    balls = Marker(header=header, ns=body_id, id=1, type=Marker.SPHERE_LIST)
    balls.scale.x = balls.scale.y = balls.scale.z = JOINT_DIAMETER
    bones.pose.orientation.w = balls.pose.orientation.w = 1.0
    bones.lifetime.sec = balls.lifetime.sec = MARKER_LIFETIME_S
    points = _points(estimate.joints)
    for ends in bone_ends(model):
        bones.points += [points[JOINT_INDEX[joint]] for joint in ends]
    balls.points = points
    balls.colors = [
        ColorRGBA(**dict(zip("rgb", STATE_COLORS[TrackingState(state)], strict=True)), a=1.0)
        for state in estimate.tracking_state
    ]
    return MarkerArray(markers=[bones, balls])


def bone_ends(model: BodyModel) -> list[tuple[str, str]]:
    """The joints between which a bone is drawn."""
    ends = []
    for joint, place in model.joints.items():
        start = model.links[place.link].joint
        if start is None:
            start = "torso" if joint != "torso" else "neck"
        ends.append((start, joint))
    return ends


def to_static_tf(T_map_sensor: Mapping[str, FloatArray]) -> TFMessage:
    """Pose of each Kinect in map, (4, 4) by sensor name, as static transforms."""
    return TFMessage(transforms=_sensor_transforms(to_header(0, WORLD_FRAME), T_map_sensor))


def to_extrinsics_messages(extrinsics: Extrinsics, stamp_ns: int) -> list[TransformStamped]:
    """Pose of each sensor in the frame of the reference, one message for each sensor."""
    header = to_header(stamp_ns, sensor_frame(extrinsics.reference))
    others = {s: T for s, T in extrinsics.T_reference_sensor.items() if s != extrinsics.reference}
    return _sensor_transforms(header, others)


def to_clock_messages(clocks: Clocks, stamp_ns: int) -> list[TimeReference]:
    """Time of each source's clock at an instant of the reference's, one message for each source."""
    return [
        TimeReference(
            header=to_header(stamp_ns, "" if is_imus(source) else sensor_frame(source)),
            time_ref=ns_to_stamp(stamp_ns + clock.ahead_ns(stamp_ns + clock.offset_ns)),
            source=source,
        )
        for source, clock in clocks.items()
    ]


def _sensor_transforms(
    header: Header, T_parent_sensor: Mapping[str, FloatArray]
) -> list[TransformStamped]:
    transforms = []
    for sensor, T in T_parent_sensor.items():
        turn = np.empty(4)
        quaternion(np.ascontiguousarray(T[:3, :3], float), turn)
        transforms.append(to_transform(header, sensor_frame(sensor), (*T[:3, 3], *turn)))
    return transforms


def _points(positions: FloatArray) -> list[Point]:
    return [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in positions]
