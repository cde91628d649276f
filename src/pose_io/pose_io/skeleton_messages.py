"""Conversion of skeleton messages, of ROS or of rosbags, to samples."""

from typing import Any

import numpy as np

from pose_core.api import SkeletonSample
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_core.stamps import nanoseconds
from pose_io.cdr.skeleton_bytes import our_joints


def skeleton_samples(message: Any, sensor: str) -> list[SkeletonSample]:
    """The persons of a ``pose_msgs/SkeletonArray`` (of ROS or of rosbags)."""
    return [skeleton_sample(skeleton, sensor) for skeleton in message.skeletons]


def skeleton_sample(message: Any, sensor: str) -> SkeletonSample:
    """Convert a ``pose_msgs/Skeleton``; joints that it lacks are NaN and NOT_TRACKED.

    Raises:
        InputError: If its lists differ in length, or a tracking state is none of the three.
    """
    count = len(message.name)
    if len(message.position) != count or len(message.tracking_state) != count:
        raise InputError(
            f"skeleton '{message.id}' has {count} names, {len(message.position)} positions and "
            f"{len(message.tracking_state)} tracking states: expected as many of each"
        )
    strange = set(message.tracking_state) - set(TrackingState)
    if strange:
        raise InputError(
            f"skeleton '{message.id}' has the tracking state {min(strange)}: expected 0 (not "
            "tracked), 1 (inferred) or 2 (tracked)"
        )
    ours = {JOINT_INDEX[n]: index for index, n in enumerate(message.name) if n in JOINT_INDEX}
    named = np.array(list(ours.values()), np.int64)
    xyz = np.array([(p.x, p.y, p.z) for p in message.position], float).reshape(1, -1, 3)
    states = np.array(message.tracking_state, np.uint8).reshape(1, -1)
    (positions,), (state,) = our_joints(xyz, states, named, np.array([*ours], np.int64))
    return SkeletonSample(
        stamp_ns=nanoseconds(message.header.stamp),
        sensor=sensor,
        person=message.id,
        positions=positions,
        tracking_state=state,
    )
