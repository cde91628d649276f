"""Many poses of an estimator as few arrays, as they go from the estimator to who tells them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pose_core.body.model import BodyModel
from pose_core.fusion.estimates import EstimateBlock
from pose_core.fusion.observation_block import Observation, stacked
from pose_core.kernels.frames import place_origins
from pose_core.kernels.reading import StateNumbers
from pose_core.streams.samples import FloatArray


@dataclass(kw_only=True)
class FusedPose:
    """A pose in the model's degrees of freedom, with provenance; arrays over d of them."""

    position: FloatArray  # [m], [rad]; the root's rotation is the vector of R_map_body
    velocity: FloatArray
    variance: FloatArray  # NaN: not known
    weight_kinect: FloatArray
    weight_imu: FloatArray
    source: NDArray[np.uint8]
    rotations: FloatArray  # (links, 3, 3): R_map_link
    joints: FloatArray  # (15, 3) [m] in map
    sensor_weight: FloatArray  # (sensors, 15): each sensor's share in each joint


EstimatedPose: TypeAlias = FusedPose | StateNumbers
"""A pose that is told as it is, or a filter's state, of which it is still to be read."""


@dataclass(frozen=True, kw_only=True)
class TimedPose:
    """A pose and when it was."""

    stamp_ns: int  # [ns]
    tracking_state: NDArray[np.uint8]  # (sensors, 15)
    pose: EstimatedPose


def timed(pose: EstimatedPose, observation: Observation) -> TimedPose:
    """A pose of an observation's instant."""
    return TimedPose(
        stamp_ns=observation.stamp_ns, tracking_state=observation.tracking_state, pose=pose
    )


@dataclass(frozen=True, kw_only=True)
class StateBlock:
    """n states of one body's segment filter, one at least."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    newest_ns: NDArray[np.int64]  # (n,) [ns] stamp of the newest sample of any source by then
    tracking_state: NDArray[np.uint8]  # (n, sensors, 15)
    states: StateNumbers  # n rows


PoseBlock: TypeAlias = EstimateBlock | StateBlock
"""What is told already, or is to be by :class:`pose_core.fusion.telling.Telling`."""


def block_of_poses(
    poses: Sequence[TimedPose],
    newest_ns: Sequence[int],
    model: BodyModel,
    sensors: Sequence[str],
) -> PoseBlock:
    """Poses of one estimator as a block.

    Args:
        poses: n poses and their instants, one at least.
        newest_ns: Of each, stamp of the newest sample of any source by then [ns].
        model: The body model.
        sensors: Names, in the order of the poses' weights.
    """
    stamps_ns = np.array([each.stamp_ns for each in poses], np.int64)
    tracking_state = stacked([each.tracking_state for each in poses])
    states = [each.pose for each in poses if isinstance(each.pose, StateNumbers)]
    if states:
        return StateBlock(
            stamps_ns=stamps_ns,
            newest_ns=np.array(newest_ns, np.int64),
            tracking_state=tracking_state,
            states=StateNumbers(*map(stacked, zip(*states, strict=True))),
        )
    fused = [each.pose for each in poses if isinstance(each.pose, FusedPose)]
    position = stacked([each.position for each in fused])
    joints = stacked([each.joints for each in fused])
    rotations = stacked([each.rotations for each in fused])
    return EstimateBlock(
        stamps_ns=stamps_ns,
        newest_ns=np.array(newest_ns, np.int64),
        dof_names=model.dof_names,
        position=position,
        velocity=stacked([each.velocity for each in fused]),
        position_stddev=np.sqrt(stacked([each.variance for each in fused])),
        weight_kinect=stacked([each.weight_kinect for each in fused]),
        weight_imu=stacked([each.weight_imu for each in fused]),
        source=stacked([each.source for each in fused]),
        joints=joints,
        tracking_state=tracking_state.max(axis=1),
        link_names=model.link_names,
        T_map_link=link_transforms(position, rotations, joints, model.link_joints),
        sensors=tuple(sensors),
        sensor_weight=stacked([each.sensor_weight for each in fused]),
    )


def link_transforms(
    position: FloatArray,
    rotations: FloatArray,
    joints: FloatArray,
    turns_about: NDArray[np.int64],
) -> FloatArray:
    """The links' transforms: each has its origin at the joint that it turns about.

    Args:
        position: Degrees of freedom, the root's place [m] first, shape (n, d).
        rotations: ``R_map_link``, shape (n, links, 3, 3).
        joints: In map [m], shape (n, 15, 3).
        turns_about: The joint of each link, shape (links,); −1 of the root.

    Returns:
        ``T_map_link``, shape (n, links, 4, 4).
    """
    T_map_link = np.empty((*rotations.shape[:2], 4, 4))
    position, rotations = np.ascontiguousarray(position), np.ascontiguousarray(rotations)
    joints = np.ascontiguousarray(joints)
    for row, filled in enumerate(T_map_link):
        place_origins(position[row], rotations[row], joints[row], turns_about, filled)
    return T_map_link
