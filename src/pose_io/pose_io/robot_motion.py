"""A robot's joints recorded during tele-operation: requested, commanded and measured."""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.stamps import nanoseconds
from pose_io.arrays import IntArray
from pose_io.bags import BagReader

TARGET, COMMAND, ROBOT = "arm/target", "arm/command", "arm/joint_states"


@dataclass(frozen=True, kw_only=True)
class JointMotion:
    """Joint states of one topic: n messages, d joints."""

    joints: tuple[str, ...]
    stamps_ns: IntArray  # (n,) of the messages
    recorded_ns: IntArray  # (n,) when they were received
    position: FloatArray  # (n, d) [rad]
    velocity: FloatArray  # (n, d) [rad/s]; NaN where the message has none


def read_joint_motion(bag: BagReader, ending: str) -> JointMotion | None:
    """Joint states of the topic with this ending, in any namespace; None if there are none."""
    topics = [
        each
        for each in sorted(bag.topics_of_type("sensor_msgs/msg/JointState"))
        if each.endswith(f"/{ending}")
    ]
    if not topics:
        return None
    stamps, recorded, position, velocity = [], [], [], []
    joints: tuple[str, ...] = ()
    for message in bag.messages(topics[:1]):
        content = bag.deserialize(message)
        joints = joints or tuple(content.name)
        if tuple(content.name) != joints:
            continue
        stamps.append(nanoseconds(content.header.stamp))
        recorded.append(message.stamp_ns)
        position.append(np.asarray(content.position, float))
        known = len(content.velocity) == len(joints)
        velocity.append(np.asarray(content.velocity) if known else np.full(len(joints), np.nan))
    if not stamps:
        return None
    return JointMotion(
        joints=joints,
        stamps_ns=np.array(stamps, np.int64),
        recorded_ns=np.array(recorded, np.int64),
        position=np.array(position),
        velocity=np.array(velocity),
    )
