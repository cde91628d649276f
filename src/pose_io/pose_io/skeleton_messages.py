"""Conversion of skeleton messages, of ROS or of rosbags, to samples."""

from typing import Any

import numpy as np

from pose_core.api import SkeletonSample
from pose_core.joints import JOINTS, TrackingState
from pose_core.stamps import nanoseconds
from pose_io.cdr.kernels import clean_joints
from pose_io.cdr.skeleton_bytes import mapped_joints, unknown_state


def skeleton_samples(message: Any, sensor: str) -> list[SkeletonSample]:
    """The persons of a ``pose_msgs/SkeletonArray`` (of ROS or of rosbags)."""
    return [skeleton_sample(skeleton, sensor) for skeleton in message.skeletons]


def skeleton_sample(message: Any, sensor: str) -> SkeletonSample:
    """Convert a ``pose_msgs/Skeleton``; joints that it lacks are NaN and NOT_TRACKED.

    Raises:
        InputError: If its lists differ in length, or a tracking state is none of the three.
    """
    named, joints = mapped_joints(
        message.id, message.name, len(message.position), len(message.tracking_state)
    )
    strange = set(message.tracking_state) - set(TrackingState)
    if strange:
        raise unknown_state(message.id, min(strange))
    xyz = np.array([(p.x, p.y, p.z) for p in message.position], float).reshape(1, -1, 3)
    states = np.array(message.tracking_state, np.uint8).reshape(1, -1)
    positions = np.empty((1, len(JOINTS), 3))
    state = np.empty((1, len(JOINTS)), np.uint8)
    clean_joints(xyz, states, named, joints, positions, state)
    return SkeletonSample(
        stamp_ns=nanoseconds(message.header.stamp),
        sensor=sensor,
        person=message.id,
        positions=positions[0],
        tracking_state=state[0],
    )
