"""How far off a joint of the estimate may be, and the tracking state that follows from it."""

import numpy as np
from numpy.typing import NDArray

from pose_core.joints import TrackingState
from pose_core.kernels.forward_kinematics import ModelArrays
from pose_core.kernels.joint_angle_extraction import StateNumbers
from pose_core.streams.samples import FloatArray

TRACKED_STDDEV = 0.25  # [m] of a joint that counts as tracked, over its three axes
INFERRED_STDDEV = 0.60  # [m] of one that is known at all
MEASURED = 1.0  # [1/rad²] information on a link that is measured


def joint_stddev(states: StateNumbers, numbers: ModelArrays) -> FloatArray:
    """Standard deviation of each joint's position over its three axes, (n, joints) [m].

    A joint at p in a link whose rotation is off by a small vector with covariance C is off by
    tr(C) |p|² − pᵀ C p; the deviations of a chain's links add up from the root on.

    Args:
        states: n rows; the covariances are of each link relative to its parent.
        numbers: The body model.
    """
    count, links = states.rotations.shape[:2]
    absolute = np.empty((count, links, 3, 3))
    base = np.empty((count, links))
    variance = np.empty((count, len(numbers.offsets)))
    for link in range(links):
        parent, about = int(numbers.parents[link]), int(numbers.turns_about[link])
        absolute[:, link] = states.covariance[:, link]
        if parent >= 0:
            absolute[:, link] += absolute[:, parent]
        base[:, link] = states.place_variance.sum(axis=1) if about < 0 else variance[:, about]
        C = absolute[:, link]
        for joint in np.flatnonzero(numbers.link_of_joint == link).tolist():
            p = states.rotations[:, link] @ numbers.offsets[joint]
            squared = float(numbers.offsets[joint] @ numbers.offsets[joint])
            turned = np.trace(C, axis1=1, axis2=2) * squared - np.einsum("ni,nij,nj->n", p, C, p)
            variance[:, joint] = base[:, link] + np.maximum(turned, 0.0)
    stddev: FloatArray = np.sqrt(variance * states.scale)
    return stddev


def tracking_states(states: StateNumbers, numbers: ModelArrays) -> NDArray[np.uint8]:
    """Tracking state of each joint of the estimate, (n, joints): tracked if it is measured now."""
    stddev = joint_stddev(states, numbers)
    information = np.trace(states.information.sum(axis=1), axis1=2, axis2=3)
    is_measured = (information > MEASURED)[:, numbers.link_of_joint]
    state = np.full(stddev.shape, int(TrackingState.NOT_TRACKED), np.uint8)
    state[stddev <= INFERRED_STDDEV] = int(TrackingState.INFERRED)
    state[is_measured & (stddev <= TRACKED_STDDEV)] = int(TrackingState.TRACKED)
    return state
