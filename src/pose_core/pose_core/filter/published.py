"""The published part of a filter state, at its own instant or at a later one.

Joints are published with a part of their slides only: besides what joints really move within their
links, slides take in the trackers' slow offsets.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.filter.constants import FilterConstants
from pose_core.filter.imu import ImuReadings
from pose_core.filter.motion import predict_error_state
from pose_core.filter.state import FilterState
from pose_core.filter.step import update_with_imus
from pose_core.kernels.compiling import compiled
from pose_core.kernels.joint_angle_extraction import StateNumbers
from pose_core.kernels.joint_kinematics import BodyArrays, Pose, compute_joints

PUBLISHED_SLIDE = 0.6  # [-] of a slide


@compiled
def copy_published(
    body: BodyArrays, state: FilterState, parents: NDArray[np.int64], out: StateNumbers
) -> None:
    """Copy the published part of a state.

    Args:
        body: The tree of links.
        state: The state.
        parents: Parents of its links, (links,); −1 for the root.
        out: Filled, except information and scale, which are not in the state.
    """
    pose, P = state.pose, state.P
    levers = np.zeros((len(out.joints), len(parents), 3))
    slides = PUBLISHED_SLIDE * pose.slides
    compute_joints(body, pose.position, pose.rotations, slides, levers, out.joints)
    for axis in range(3):
        out.position[axis], out.velocity[axis] = pose.position[axis], pose.velocity[axis]
        out.place_variance[axis] = P[axis, axis]
    for link in range(len(parents)):
        own, above = 3 + 3 * link, 3 + 3 * parents[link]
        for a in range(3):
            out.rates[link, a] = pose.rates[link, a]
            for b in range(3):
                out.rotations[link, a, b] = pose.rotations[link, a, b]
                relative = P[own + a, own + b]
                if parents[link] >= 0:
                    relative += P[above + a, above + b]
                    relative -= P[own + a, above + b] + P[above + a, own + b]
                out.covariance[link, a, b] = relative


@compiled
def predict_published(
    constants: FilterConstants,
    state: FilterState,
    dt_s: float,
    readings: ImuReadings,
    parents: NDArray[np.int64],
    out: StateNumbers,
) -> bool:
    """Copy the published part of a state advanced by ``dt_s`` [s]; the state does not change.

    Args:
        constants: The filter's constants.
        state: The state.
        dt_s: Time since the state's instant [s].
        readings: Samples of the aligned IMUs at the later instant.
        parents: Parents of the links, (links,); −1 for the root.
        out: As of :func:`copy_published`; the IMUs' share is added to the information.

    Returns:
        Whether the result is finite.
    """
    ahead = copy_error_state(state)
    predict_error_state(constants.motion, ahead, dt_s)
    # Only the covariance of position and rotations is published.
    known = 3 + 3 * len(parents)
    if not update_with_imus(constants, ahead, readings, known, out.information[1]):
        return False
    copy_published(constants.camera.body, ahead, parents, out)
    return True


@compiled
def copy_error_state(state: FilterState) -> FilterState:
    """A copy whose mean and covariance may be changed; everything else is the state's own."""
    pose = state.pose
    return FilterState(
        Pose(
            pose.position.copy(),
            pose.rotations.copy(),
            pose.slides.copy(),
            pose.velocity.copy(),
            pose.rates.copy(),
        ),
        state.P.copy(),
        state.delay,
        state.delay_sums,
        state.R_sensor_link.copy(),
        state.heading.copy(),
        state.imu_column,
        state.offset,
        state.offset_variance,
        state.nis,
        state.silent_s,
        state.adaptation,
        state.contradicted_s,
        state.waist_mean,
        state.waist_s,
        state.shared_offset,
    )
