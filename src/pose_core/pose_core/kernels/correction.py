"""The segment filter's update: everything that is known of an instant, at once."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.camera import CameraLooks, add_cameras
from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.inverse import add_information
from pose_core.kernels.links import LinkLooks, add_imus, own_blocks, turn_back
from pose_core.kernels.placing import BodyNumbers, Pose
from pose_core.kernels.posture import PostureNumbers, add_posture
from pose_core.kernels.prediction import move
from pose_core.kernels.side_swaps import SwapNumbers, unswap_cameras
from pose_core.kernels.tracker import TrackerNumbers
from pose_core.streams.samples import FloatArray

MOST = 20.0  # [-] a squared Mahalanobis distance that counts no more than that


class Outcome(NamedTuple):
    """What an update did."""

    is_definite: bool  # False: the covariance has broken
    flipped: int  # limbs turned by half a turn
    swapped: int  # groups of joints that a tracker took for the other side's
    typical: (
        float  # mean squared Mahalanobis distance of what is seen, each at most MOST; NaN: none
    )
    farthest: float  # the largest of them; NaN: none


class Expectations(NamedTuple):
    """What is known of one body beforehand."""

    body: BodyNumbers
    tracker: TrackerNumbers
    limb_ends: NDArray[np.int64]  # see :func:`pose_core.kernels.tracker.foreshortening`
    swaps: SwapNumbers
    posture: PostureNumbers
    wrong_bend: float  # see :func:`pose_core.kernels.links.turn_back`


@compiled
def correct(
    expected: Expectations,
    cameras: CameraLooks,
    imus: LinkLooks,
    pose: Pose,
    P: FloatArray,
    memory: FloatArray,
    predicted: Pose,
    distance: FloatArray,
    of_links: FloatArray,
) -> Outcome:
    """Take what cameras, IMUs and the posture tell, and move the pose, in place.

    Args:
        expected: What is known beforehand.
        cameras: What the cameras saw, maybe none of them anything.
        imus: What the IMUs say, maybe of no link.
        pose: The state.
        P: Its covariance.
        memory: See :func:`pose_core.kernels.camera.add_camera`.
        predicted: Filled: the state as it was.
        distance: Filled, (joints,): squared Mahalanobis distance of each joint; NaN unseen.
        of_links: Filled, (2, links, 3, 3): the cameras' and the IMUs' own information of each link.
    """
    keep_pose(pose, predicted)
    # Only IMUs' rates, and cameras that saw what was a while ago, tell of rates.
    tells_rates = len(imus.links) > 0 or cameras.delay_s != 0.0
    informed = len(P) if tells_rates else 3 + 3 * len(pose.rotations) + 3 * len(pose.slides)
    information, vector = np.zeros((informed, informed)), np.zeros(informed)
    distance[:] = np.nan
    seen = CameraLooks(
        cameras.positions.copy(),
        cameras.tracking_state.copy(),
        cameras.cameras,
        cameras.offsets,
        cameras.delay_s,
    )
    swaps = unswap_cameras(expected.body, pose, expected.swaps, seen.positions, seen.tracking_state)
    add_cameras(
        expected.body,
        expected.tracker,
        expected.limb_ends,
        seen,
        pose,
        P,
        memory,
        information,
        vector,
        distance,
    )
    own_blocks(information, of_links[0])
    add_imus(pose, imus, information, vector)
    own_blocks(information, of_links[1])
    of_links[1] -= of_links[0]
    posture = expected.posture
    add_posture(posture, pose.rotations, information, vector)
    typical, farthest = judge(distance)
    if not add_information(P, information):
        return Outcome(False, 0, swaps, typical, farthest)
    move(pose, np.dot(vector, P[:informed]))
    hinges = (posture.hinge_parents, posture.hinge_links, posture.hinge_signs)
    flipped = turn_back(pose.rotations, hinges[0], hinges[1], hinges[2], expected.wrong_bend)
    return Outcome(True, flipped, swaps, typical, farthest)


@compiled_in_place
def judge(distance: FloatArray) -> tuple[float, float]:
    """The mean of the distances that are known, each at most :data:`MOST`, and the largest."""
    total, count, farthest = 0.0, 0, np.nan
    for each in distance:
        if np.isfinite(each):
            total += min(each, MOST)
            count += 1
            farthest = each if count == 1 else max(farthest, each)
    return total / count if count > 0 else np.nan, farthest


@compiled
def keep_pose(pose: Pose, out: Pose) -> None:
    """Copy a pose."""
    out.position[:] = pose.position
    out.rotations[:] = pose.rotations
    out.slides[:] = pose.slides
    out.velocity[:] = pose.velocity
    out.rates[:] = pose.rates
