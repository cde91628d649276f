"""Conversion of messages, of ROS or of a bag, to snapshots."""

from typing import Any

import numpy as np

from pose_core.api import BodyEstimate, FloatArray
from pose_core.joints import JOINT_INDEX
from pose_core.stamps import nanoseconds
from pose_io.skeleton_messages import skeleton_sample
from pose_view.robot import root_and_links
from pose_view.snapshot import BodySnapshot, DofSnapshot

ROOT_PREFIX = "body_"


def dof_snapshot(message: Any) -> DofSnapshot:
    """Convert a ``pose_msgs/PoseEstimate``."""
    return DofSnapshot(
        names=tuple(message.name),
        position=np.asarray(message.position, float),
        stddev=np.asarray(message.position_stddev, float),
        weight_imu=np.asarray(message.weight_imu, float),
        source=np.asarray(message.state, np.uint8),
        latency_s=float(message.latency),
    )


def body_snapshot(
    message: Any, dof: DofSnapshot | None, rotations: dict[str, FloatArray] | None
) -> BodySnapshot:
    """Convert a body's ``pose_msgs/Skeleton``, with its degrees of freedom and rotations.

    Raises:
        InputError: If the message is inconsistent.
    """
    sample = skeleton_sample(message, "")
    # An estimate has positions of joints that no camera tracks: those are not NaN.
    joints = np.full((len(JOINT_INDEX), 3), np.nan)
    for name, point in zip(message.name, message.position, strict=True):
        if name in JOINT_INDEX:
            joints[JOINT_INDEX[name]] = point.x, point.y, point.z
    stamp_ns, state = sample.stamp_ns, sample.tracking_state
    return BodySnapshot(
        stamp_ns=stamp_ns, joints=joints, tracking_state=state, dof=dof, rotations=rotations or {}
    )


def link_rotations(message: Any) -> tuple[str, int, dict[str, FloatArray]] | None:
    """The body, the stamp [ns] and ``R_map_link`` by link of a ``tf2_msgs/TFMessage``.

    None if it has no body: ``map`` → ``body_<id>`` → ``<link>_<id>``.
    """
    found = root_and_links(message, ROOT_PREFIX)
    if found is None:
        return None
    (root, *links), turns = found
    body = root.child_frame_id[len(ROOT_PREFIX) :]
    names = [t.child_frame_id.removesuffix(f"_{body}") for t in links]
    R_map_link = (turns[0] * turns[1:]).as_matrix()
    return body, nanoseconds(root.header.stamp), dict(zip(names, R_map_link, strict=True))


def estimate_snapshot(estimate: BodyEstimate) -> BodySnapshot:
    """Convert an estimate of a fusion in this process."""
    return BodySnapshot(
        stamp_ns=estimate.stamp_ns,
        joints=estimate.joints,
        tracking_state=estimate.tracking_state,
        dof=DofSnapshot(
            names=estimate.dof_names,
            position=estimate.position,
            stddev=estimate.position_stddev,
            weight_imu=estimate.weight_imu,
            source=estimate.source,
            latency_s=0.0,
        ),
        rotations=dict(zip(estimate.link_names, estimate.T_map_link[:, :3, :3], strict=True)),
    )
