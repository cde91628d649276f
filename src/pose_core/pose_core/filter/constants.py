"""Constants of the default filter for one body and one tuning, in the form of the kernels."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.body.segment_tree import SegmentTree, without_side
from pose_core.filter.camera import CameraConstants
from pose_core.filter.imu import ImuConstants
from pose_core.filter.motion import MotionConstants
from pose_core.filter.occlusion import make_capsules
from pose_core.filter.posture import PostureConstants
from pose_core.filter.shared_offsets import SharedOffsetConstants
from pose_core.filter.tracker_errors import TrackerErrorConstants
from pose_core.filter.tuning import FilterTuning, ImuNoise
from pose_core.filter.update import UpdateConstants
from pose_core.joints import JOINT_INDEX, JOINT_PAIRS
from pose_core.kernels.left_right_swaps import SWAPS, SwapArrays

FRAME_PERIOD_S = 1.0 / 30.0  # over which the accelerations' standard deviations are defined


class FilterConstants(NamedTuple):
    """All quantities that are constant while one person is tracked."""

    motion: MotionConstants
    camera: CameraConstants
    posture: PostureConstants
    imu: ImuConstants
    shared_offsets: SharedOffsetConstants
    swaps: SwapArrays
    tracker_errors: TrackerErrorConstants
    frame_update: UpdateConstants
    imu_update: UpdateConstants


def make_constants(
    tree: SegmentTree, tuning: FilterTuning, known_delay_s: float = 0.0
) -> FilterConstants:
    """Constants of a body; ``known_delay_s`` [s] is the prior mean of the trackers' delays."""
    return FilterConstants(
        motion=_motion(tree, tuning),
        camera=CameraConstants(
            body=tree.arrays,
            capsules=make_capsules(),
            variance=tuning.camera.stddev**2,
            inferred_variance=tuning.camera.inferred_stddev**2,
            occluded_variance=tuning.camera.occluded_stddev**2,
            student_dof=tuning.camera.student_dof,
        ),
        posture=_posture(tree, tuning),
        imu=_imu(tree.model, tuning.imu),
        shared_offsets=_shared_offsets(tree, tuning),
        swaps=SWAPS,
        tracker_errors=TrackerErrorConstants(
            starts=tree.model.link_joints,
            ends=_link_ends(tree.model),
            strap_swing=_by_link(tree.model, tuning.imu.strap_swing),
            usual_correlation=_by_link(tree.model, tuning.imu.usual_correlation),
            delay_prior=tuning.camera.delay_prior,
            delay_memory_s=tuning.camera.delay_memory,
            known_delay_s=float(known_delay_s),
            nis_memory_s=tuning.camera.nis_memory,
        ),
        frame_update=UpdateConstants(iterations=2, least_weight=tuning.camera.least_weight),
        imu_update=UpdateConstants(iterations=1, least_weight=tuning.imu.least_weight),
    )


def _motion(tree: SegmentTree, tuning: FilterTuning) -> MotionConstants:
    motion, kinds = tuning.motion, [without_side(name) for name in tree.model.link_names]
    path = np.eye(len(kinds))
    for link, parent in enumerate(tree.parents):
        if parent >= 0:
            path[link] += motion.carried[kinds[link]] * path[parent]
    own = np.array([motion.acceleration[kind] for kind in kinds])
    return MotionConstants(
        root_power=motion.root_acceleration**2 * FRAME_PERIOD_S,
        power=path @ np.diag(own**2 * FRAME_PERIOD_S) @ path.T,
        rate_memory_s=motion.rate_memory,
        slide_memory_s=motion.slide_memory,
        slide_variance=np.array(
            [motion.slide_stddev[without_side(joint)] ** 2 for joint in tree.model.sliding]
        ),
        offset_memory_s=tuning.camera.offset_memory,
        offset_variance=tuning.camera.offset_stddev**2,
        alignment_walk=tuning.imu.alignment_walk**2,
        heading_walk=tuning.imu.heading_walk**2,
        heading_drift_walk=tuning.imu.heading_drift_walk**2,
    )


def _posture(tree: SegmentTree, tuning: FilterTuning) -> PostureConstants:
    prior, names = tuning.posture, tree.model.link_names
    turning, spine = np.array(tree.turning, np.int64), np.array(tree.spine, np.int64)
    stddev = np.array([prior.twist_stddev[without_side(names[link])] for link in turning])
    return PostureConstants(
        hinges=tree.hinges,
        hinge_variance=prior.hinge_stddev**2,
        wrong_bend=-prior.wrong_bend,
        twist_parents=tree.parents[turning],
        twist_links=turning,
        twist_variance=stddev**2,
        spine_parents=tree.parents[spine],
        spine_links=spine,
        spine_variance=np.square(prior.waist_stddev),
    )


def _imu(model: BodyModel, noise: ImuNoise) -> ImuConstants:
    stddev = np.full((len(model.links), 3), noise.orientation_stddev)
    rate_stddev = np.full((len(model.links), 3), noise.rate_stddev)
    for name, bend in noise.spine_bend.items():
        stddev[model.link_index[name], 1] = bend
    for name, bend_rate in noise.spine_bend_rate.items():
        rate_stddev[model.link_index[name], 1] = bend_rate
    return ImuConstants(
        stddev=stddev,
        soft_tissue=noise.soft_tissue,
        correlated_samples=noise.correlated_samples,
        student_dof=noise.student_dof,
        rate_stddev=rate_stddev,
    )


def _by_link(model: BodyModel, values: Mapping[str, float]) -> FloatArray:
    """Values of all links from those by kind of link; 1 for others."""
    return np.array([values.get(without_side(name), 1.0) for name in model.link_names])


def _shared_offsets(tree: SegmentTree, tuning: FilterTuning) -> SharedOffsetConstants:
    """Constants of the shared offsets; a body model without a waist disables them."""
    trunk = tree.spine[0] if tree.spine else 0
    pelvis = int(tree.parents[trunk]) if tree.spine else 0

    def half(joint: str, link: int) -> float:
        """Half the distance between a pair of joints [m]."""
        left, right = tree.offsets[JOINT_PAIRS[joint], link, 1]
        return float(0.5 * (left - right))

    hips, shoulders = half("hip", pelvis), half("shoulder", trunk)
    variance = 0.5 * tuning.camera.shared_offset_stddev**2 if tree.spine else 0.0
    return SharedOffsetConstants(
        trunk=trunk,
        half_hips=hips,
        half_shoulders=shoulders,
        hips_variance=variance / hips**2,
        shoulders_variance=variance / shoulders**2,
        mean_variance=np.square(tuning.posture.waist_mean_stddev),
    )


def _link_ends(model: BodyModel) -> NDArray[np.int64]:
    """The joint at the far end of each link; the left hip for the root, the neck for the trunk."""
    ends = []
    for name, link in model.links.items():
        far = "left_hip" if link.joint is None else model.ends(name)[1]
        ends.append(JOINT_INDEX["neck" if without_side(name) == "trunk" else far])
    return np.array(ends, np.int64)
