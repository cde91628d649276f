r"""Tracking state of each estimated joint, from its own uncertainty.

If the rotation of a link has a small error with covariance C, a joint at p in it has the variance

.. math:: \sigma^2 = \sigma_\mathrm{origin}^2 + \mathrm{tr}(C)\,|p|^2 - p^\top C\,p

over its three axes. C sums the covariances of the chain's links, each relative to its parent.
"""

import numpy as np
from numpy.typing import NDArray

from pose_core.joints import TrackingState
from pose_core.kernels.compiling import compiled
from pose_core.kernels.forward_kinematics import ModelArrays
from pose_core.kernels.published_state import PublishedState

TRACKED_STDDEV = 0.25  # [m] bound for TRACKED, over the three axes
INFERRED_STDDEV = 0.60  # [m] bound for INFERRED, over the three axes
MIN_TRACKED_INFORMATION = 1.0  # [1/rad²] information on a link that counts as measured


@compiled
def tracking_states(model: ModelArrays, states: PublishedState, out: NDArray[np.uint8]) -> None:
    """Determine the tracking states of n poses; TRACKED requires a measurement.

    Args:
        model: The body model.
        states: n rows.
        out: Filled, (n, joints).
    """
    links, joints = len(model.parents), len(model.offsets)
    absolute, variance = np.empty((links, 3, 3)), np.empty(joints)
    p = np.empty(3)
    for row in range(len(out)):
        for link in range(links):
            C, parent, about = absolute[link], model.parents[link], model.pivot_joints[link]
            information = trace = 0.0
            for i in range(3):
                for k in range(3):
                    C[i, k] = states.covariance[row, link, i, k]
                    if parent >= 0:
                        C[i, k] += absolute[parent, i, k]
                trace += C[i, i]
                for source in range(2):
                    information += states.information[row, source, link, i, i]
            origin = states.position_variance[row].sum() if about < 0 else variance[about]
            for joint in range(joints):
                if model.link_of_joint[joint] != link:
                    continue
                turned = 0.0
                for i in range(3):
                    p[i] = 0.0
                    for k in range(3):
                        p[i] += states.rotations[row, link, i, k] * model.offsets[joint, k]
                for i in range(3):
                    turned += trace * p[i] * p[i]
                    for k in range(3):
                        turned -= p[i] * C[i, k] * p[k]
                variance[joint] = origin + max(turned, 0.0)
                stddev = np.sqrt(variance[joint] * states.scale[row, 0])
                state = TrackingState.NOT_TRACKED
                if stddev <= INFERRED_STDDEV:
                    is_measured = information > MIN_TRACKED_INFORMATION and stddev <= TRACKED_STDDEV
                    state = TrackingState.TRACKED if is_measured else TrackingState.INFERRED
                out[row, joint] = state
