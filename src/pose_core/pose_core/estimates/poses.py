"""Poses of an estimator as arrays, before joint angles are extracted from them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.kinematics import BodyPose
from pose_core.body.model import BodyModel
from pose_core.estimates.body_estimates import EstimateBlock
from pose_core.kernels.link_frames import compute_link_transforms
from pose_core.kernels.published_state import PublishedState, Source


@dataclass(kw_only=True)
class FusedPose:
    """A pose in the model's d degrees of freedom, with provenance."""

    position: FloatArray  # [m], [rad]; the root's rotation is the vector of R_map_body
    velocity: FloatArray
    variance: FloatArray  # NaN: unknown
    weight_kinect: FloatArray
    weight_imu: FloatArray
    source: NDArray[np.uint8]
    rotations: FloatArray  # (links, 3, 3): R_map_link
    joints: FloatArray  # (15, 3) [m] in map
    tracking_state: NDArray[np.uint8]  # (15,) best state over the sensors


def pose_by_cameras(
    position: FloatArray,
    velocity: FloatArray,
    variance: FloatArray,
    is_seen: NDArray[np.bool_] | bool,
    body: BodyPose,
    tracking_state: NDArray[np.uint8],
) -> FusedPose:
    """A pose that cameras alone measure, by now or by prediction; see :class:`FusedPose`.

    Args:
        position: (d,).
        velocity: (d,).
        variance: (d,).
        is_seen: Whether the cameras measure each degree of freedom, (d,), or all of them.
        body: Its links and joints.
        tracking_state: (15,).
    """
    seen = np.broadcast_to(is_seen, position.shape)
    return FusedPose(
        position=position.copy(),
        velocity=velocity.copy(),
        variance=variance.copy(),
        weight_kinect=seen.astype(float),
        weight_imu=np.zeros(position.shape),
        source=np.where(seen, Source.KINECT, Source.PREDICTED).astype(np.uint8),
        rotations=body.rotations,
        joints=body.positions,
        tracking_state=tracking_state,
    )


EstimatedPose: TypeAlias = FusedPose | PublishedState
"""A pose with joint angles, or a filter's state, from which they have to be extracted."""


@dataclass(frozen=True, kw_only=True)
class TimedPose:
    """A pose with its stamp."""

    stamp_ns: int  # [ns]
    pose: EstimatedPose


@dataclass(frozen=True, kw_only=True)
class StateBlock:
    """n >= 1 states of one body's filter."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    newest_ns: NDArray[np.int64]  # (n,) [ns] stamp of the newest sample of any source by then
    states: PublishedState  # n rows


def state_block(pose: PublishedState, stamp_ns: int, newest_ns: int) -> StateBlock:
    """A block of one state."""
    return StateBlock(
        stamps_ns=np.array([stamp_ns], np.int64),
        newest_ns=np.array([newest_ns], np.int64),
        states=PublishedState(*(np.ascontiguousarray(each)[None] for each in pose)),
    )


def joined_states(blocks: Sequence[StateBlock]) -> StateBlock:
    """Concatenate blocks; a single one is not copied."""
    if len(blocks) == 1:
        return blocks[0]
    states = (each.states for each in blocks)
    return StateBlock(
        stamps_ns=np.concatenate([each.stamps_ns for each in blocks]),
        newest_ns=np.concatenate([each.newest_ns for each in blocks]),
        states=PublishedState(*map(np.concatenate, zip(*states, strict=True))),
    )


def block_of_poses(
    poses: Sequence[FusedPose], stamps_ns: Sequence[int], newest_ns: Sequence[int], model: BodyModel
) -> EstimateBlock:
    """Combine poses of one estimator to a block.

    Args:
        poses: n >= 1 poses.
        stamps_ns: Their stamps [ns].
        newest_ns: For each, stamp of the newest sample of any source by then [ns].
        model: The body model.
    """
    names = [field.name for field in fields(FusedPose)]
    values = {name: np.array([vars(each)[name] for each in poses]) for name in names}
    rotations, variance = values.pop("rotations"), values.pop("variance")
    position, joints = values["position"], values["joints"]
    T_map_link = np.empty((*rotations.shape[:2], 4, 4))
    for row, filled in enumerate(T_map_link):
        compute_link_transforms(
            position[row], rotations[row], joints[row], model.link_joints, filled
        )
    return EstimateBlock(
        stamps_ns=np.array(stamps_ns, np.int64),
        newest_ns=np.array(newest_ns, np.int64),
        dof_names=model.dof_names,
        position_stddev=np.sqrt(variance),
        is_known=np.ones(position.shape, np.bool_),
        fk_joints=joints,
        link_names=model.link_names,
        T_map_link=T_map_link,
        **values,
    )
