r"""What one camera's frame tells of the pose's error, in information form.

Each joint adds :math:`H^T W H` to the information and :math:`H^T W r` to its vector, with W the
inverse of its noise, enlarged by Student's t. A frame of τ ago saw the pose less τ times its rates.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.placing import BodyNumbers, Pose
from pose_core.kernels.rotations import turn_all
from pose_core.kernels.seen_joints import (
    Frame,
    compare_joints,
    expect_joints,
    make_joints,
    weigh_joints,
)
from pose_core.kernels.tracker import TrackerNumbers
from pose_core.streams.samples import FloatArray


class CameraLooks(NamedTuple):
    """What cameras saw at one instant, a row each."""

    positions: FloatArray  # (s, joints, 3) [m] in map; NaN unseen
    tracking_state: NDArray[np.uint8]  # (s, joints)
    cameras: FloatArray  # (s, 3) [m] in map
    offsets: FloatArray  # (s, joints, 3) [m] each tracker's own, in the root's heading's axes
    delay_s: float  # τ: how far before the filter's instant this was


@compiled
def add_cameras(
    body: BodyNumbers,
    noise: TrackerNumbers,
    limb_ends: NDArray[np.int64],
    looks: CameraLooks,
    pose: Pose,
    covariance: FloatArray,
    memory: FloatArray,
    information: FloatArray,
    vector: FloatArray,
    distance: FloatArray,
) -> None:
    """Add the frames of all cameras that saw anything, see :func:`add_camera`."""
    for s in range(len(looks.positions)):
        if not np.any(looks.tracking_state[s]):
            continue
        frame = Frame(
            looks.positions[s],
            looks.tracking_state[s],
            looks.cameras[s],
            looks.offsets[s],
            looks.delay_s,
        )
        add_camera(
            body,
            noise,
            limb_ends,
            frame,
            pose,
            covariance,
            memory,
            information,
            vector,
            distance,
        )


@compiled
def add_camera(
    body: BodyNumbers,
    noise: TrackerNumbers,
    limb_ends: NDArray[np.int64],
    frame: Frame,
    pose: Pose,
    covariance: FloatArray,
    memory: FloatArray,
    information: FloatArray,
    vector: FloatArray,
    distance: FloatArray,
) -> None:
    """Add a frame's information, and tell how far each joint was off.

    Args:
        body: The tree.
        noise: The tracker's numbers.
        limb_ends: See :func:`pose_core.kernels.tracker.foreshortening`.
        frame: What the camera saw.
        pose: What the filter expects.
        covariance: Of the filter's error.
        memory: (joints, 3) [m] recent mean place of each joint relative to the root; NaN: none yet.
        information: Is added to.
        vector: Is added to.
        distance: (joints,) squared Mahalanobis distance of what is seen.
    """
    links, tau = len(pose.rotations), frame.delay_s
    moving, pose_size = 3 + 3 * links, 3 + 3 * links + 3 * len(body.sliding_links)
    rotations, spread = np.empty_like(pose.rotations), np.empty((pose_size, pose_size))
    turn_all(pose.rates, -tau, pose.rotations, rotations)
    position = pose.position - tau * pose.velocity
    joints = make_joints(len(memory), links, pose_size)
    expect_joints(body, limb_ends, frame, pose, position, rotations, joints)
    if np.isnan(memory[0, 0]):
        memory[:] = joints.places - position
    compare_joints(body, noise, frame, position, rotations, memory, joints)
    delayed_covariance(covariance, tau, moving, spread)
    HP, WH, Wr = np.dot(joints.H, spread), np.zeros_like(joints.H), np.zeros(len(joints.H))
    weigh_joints(body, noise, frame, joints, HP, WH, Wr, distance)
    add_delayed(np.dot(joints.H.T, WH), np.dot(Wr, joints.H), tau, moving, information, vector)


@compiled_in_place
def delayed_covariance(P: FloatArray, tau: float, moving: int, out: FloatArray) -> None:
    """Covariance of the pose of τ ago, e_pose − τ e_rates; rates belong to the first ``moving``."""
    size = len(out)
    of_pose, of_both, of_rates = P[:size], P[:size, size:], P[size:, size:]
    for i in range(size):
        for k in range(size):
            out[i, k] = of_pose[i, k]
    if tau == 0.0:
        return
    for i in range(size):
        for k in range(moving):
            out[i, k] -= tau * of_both[i, k]
    other = P[size:]
    for i in range(moving):
        for k in range(size):
            out[i, k] -= tau * other[i, k]
        for k in range(moving):
            out[i, k] += tau * tau * of_rates[i, k]


@compiled_in_place
def add_delayed(
    G: FloatArray,
    g: FloatArray,
    tau: float,
    moving: int,
    information: FloatArray,
    vector: FloatArray,
) -> None:
    """Information of the pose of τ ago as information of pose and rates now."""
    size = len(G)
    for i in range(size):
        vector[i] += g[i]
        for k in range(size):
            information[i, k] += G[i, k]
    if tau == 0.0:
        return
    of_rates, below = vector[size:], information[size:, :size]
    right, both = information[:size, size:], information[size:, size:]
    for i in range(moving):
        of_rates[i] -= tau * g[i]
        for k in range(size):
            below[i, k] -= tau * G[i, k]
        for k in range(moving):
            both[i, k] += tau * tau * G[i, k]
    for i in range(size):
        for k in range(moving):
            right[i, k] -= tau * G[i, k]
