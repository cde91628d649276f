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
    states = [(each.stamp_ns, bag.deserialize(each)) for each in bag.messages(topics[:1])]
    if not states:
        return None
    joints = next((tuple(state.name) for _, state in states if state.name), ())
    states = [(at_ns, state) for at_ns, state in states if tuple(state.name) == joints]
    unknown = np.full(len(joints), np.nan)
    return JointMotion(
        joints=joints,
        stamps_ns=np.array([nanoseconds(state.header.stamp) for _, state in states], np.int64),
        recorded_ns=np.array([at_ns for at_ns, _ in states], np.int64),
        position=np.array([state.position for _, state in states], float),
        velocity=np.array(
            [s.velocity if len(s.velocity) == len(joints) else unknown for _, s in states]
        ),
    )
