r"""What one camera's frame tells of the pose's error, in information form.

Each joint adds :math:`H^T W H` to the information and :math:`H^T W r` to its vector, with W the
inverse of its noise, enlarged by Student's t. A frame of τ ago saw the pose less τ times its rates.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_fusion.kernels.compiling import compiled
from pose_fusion.kernels.placing import (
    BodyNumbers,
    Pose,
    derivative,
    joint_velocities,
    place_joints,
)
from pose_fusion.kernels.rotations import turn_all
from pose_fusion.kernels.small_matrices import solve
from pose_fusion.kernels.tracker import (
    TrackerNumbers,
    foreshortening,
    inertia,
    noise_covariance,
    student_factor,
)
from pose_fusion.streams.samples import FloatArray

INFERRED = 1  # of TrackingState


class CameraLooks(NamedTuple):
    """What cameras saw at one instant, a row each."""

    positions: FloatArray  # (s, joints, 3) [m] in map; NaN unseen
    tracking_state: NDArray[np.uint8]  # (s, joints)
    cameras: FloatArray  # (s, 3) [m] in map
    offsets: FloatArray  # (s, joints, 3) [m] each tracker's own, in the root's heading's axes
    delay_s: float  # τ: how far before the filter's instant this was


class Frame(NamedTuple):
    """One camera's frame: a row of them."""

    positions: FloatArray
    tracking_state: NDArray[np.uint8]
    camera: FloatArray
    offsets: FloatArray
    delay_s: float


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
        limb_ends: See :func:`pose_fusion.kernels.tracker.foreshortening`.
        frame: What the camera saw.
        pose: What the filter expects.
        covariance: Of the filter's error.
        memory: (joints, 3) [m] recent mean place of each joint relative to the root; NaN: none yet.
        information: Is added to.
        vector: Is added to.
        distance: (joints,) squared Mahalanobis distance of what is seen.
    """
    joint_count, links, tau = len(memory), len(pose.rotations), frame.delay_s
    pose_size = 3 + 3 * links + 3 * len(body.sliding_links)
    rotations = np.empty_like(pose.rotations)
    turn_all(pose.rates, -tau, pose.rotations, rotations)
    position = pose.position - tau * pose.velocity
    levers = np.zeros((joint_count, links, 3))
    joints = np.empty((joint_count, 3))
    velocity = np.empty((joint_count, 3))
    place_joints(body, position, rotations, pose.slides, levers, joints)
    joint_velocities(body, levers, pose.velocity, pose.rates, velocity)
    rays = joints - frame.camera
    for j in range(joint_count):
        rays[j] /= np.sqrt(rays[j, 0] ** 2 + rays[j, 1] ** 2 + rays[j, 2] ** 2)
    pointing = np.empty(joint_count)
    foreshortening(joints, rays, limb_ends, pointing)
    if np.isnan(memory[0, 0]):
        memory[:] = joints - position
    spread = np.empty((pose_size, pose_size))
    delayed_covariance(covariance, tau, 3 + 3 * links, spread)
    # Of all joints at once, three rows each, of zeros where one is not seen.
    H, WH = np.zeros((3 * joint_count, pose_size)), np.zeros((3 * joint_count, pose_size))
    Ht, Wr = np.zeros((pose_size, 3 * joint_count)), np.zeros(3 * joint_count)
    R, residual = np.empty((joint_count, 3, 3)), np.empty((joint_count, 3))
    blocks = np.empty((body.columns.shape[1], 3, 3))
    for j in range(joint_count):
        if not is_seen(frame, j):
            continue
        is_inferred = frame.tracking_state[j] == INFERRED
        v = velocity[j]
        speed = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
        share = inertia(noise, speed, pointing[j], is_inferred)
        derivative(body, j, levers, rotations, 1.0 - share, blocks)
        spread_blocks(blocks, body.columns[j, : body.column_count[j]], 3 * j, H, Ht)
        expected_residual(
            frame, j, joints[j], position, memory[j], share, rotations[0], residual[j]
        )
        noise_covariance(noise, rays[j], v, speed, pointing[j], is_inferred, R[j])
    HP = np.dot(H, spread)
    for j in range(joint_count):
        if is_seen(frame, j):
            distance[j] = weigh_joint(body, noise, j, H, HP, R[j], residual[j], WH, Wr)
    add_delayed(np.dot(Ht, WH), np.dot(Ht, Wr), tau, 3 + 3 * links, information, vector)


@compiled
def is_seen(frame: Frame, joint: int) -> bool:
    """Whether the camera says where a joint is."""
    return frame.tracking_state[joint] != 0 and np.isfinite(frame.positions[joint, 0])


@compiled
def spread_blocks(
    blocks: FloatArray, columns: NDArray[np.int64], row: int, H: FloatArray, Ht: FloatArray
) -> None:
    """Put one joint's derivative in its place among all joints', and into the transpose."""
    for a in range(len(columns)):
        at = 3 * columns[a]
        for i in range(3):
            for k in range(3):
                H[row + i, at + k] = Ht[at + k, row + i] = blocks[a, i, k]


@compiled
def expected_residual(
    frame: Frame,
    joint: int,
    place: FloatArray,
    position: FloatArray,
    remembered: FloatArray,
    share: float,
    R_map_root: FloatArray,
    out: FloatArray,
) -> None:
    """What the camera saw less what it was to see: z − (p + a (m − p) + b)."""
    x, y = R_map_root[0, 0], R_map_root[1, 0]
    length = max(np.sqrt(x * x + y * y), 1e-9)
    c, s = x / length, y / length
    offset = frame.offsets[joint]
    for axis in range(3):
        out[axis] = frame.positions[joint, axis] - place[axis]
        out[axis] -= share * (remembered[axis] - (place[axis] - position[axis]))
    out[0] -= c * offset[0] - s * offset[1]
    out[1] -= s * offset[0] + c * offset[1]
    out[2] -= offset[2]


@compiled
def delayed_covariance(P: FloatArray, tau: float, moving: int, out: FloatArray) -> None:
    """Covariance of the pose of τ ago, e_pose − τ e_rates; rates belong to the first ``moving``."""
    size = len(out)
    for i in range(size):
        for k in range(size):
            out[i, k] = P[i, k]
    if tau == 0.0:
        return
    for i in range(size):
        for k in range(moving):
            out[i, k] -= tau * P[i, size + k]
    for i in range(moving):
        for k in range(size):
            out[i, k] -= tau * P[size + i, k]
        for k in range(moving):
            out[i, k] += tau * tau * P[size + i, size + k]


@compiled
def weigh_joint(
    body: BodyNumbers,
    noise: TrackerNumbers,
    joint: int,
    H: FloatArray,
    HP: FloatArray,
    R: FloatArray,
    residual: FloatArray,
    WH: FloatArray,
    Wr: FloatArray,
) -> float:
    """Fill in one joint's three rows of W H, (3 joints, size), and of W r; its squared distance.

    Args:
        body: The tree.
        noise: The tracker's numbers.
        joint: Which.
        H: Derivatives of all joints, (3 joints, size).
        HP: The same times the covariance.
        R: The joint's noise, (3, 3) [m²].
        residual: The joint's, (3,) [m].
        WH: Filled.
        Wr: Filled, (3 joints,).
    """
    columns, row = body.columns[joint, : body.column_count[joint]], 3 * joint
    S, W, solved = R.copy(), np.eye(3), np.empty((3, 1))
    for a in range(len(columns)):
        at = 3 * columns[a]
        for i in range(3):
            for k in range(3):
                for m in range(3):
                    S[i, k] += HP[row + i, at + m] * H[row + k, at + m]
    solved[:, 0] = residual
    solve(S, solved, 3)
    distance = 0.0
    for axis in range(3):
        distance += residual[axis] * solved[axis, 0]
    S[:] = R * student_factor(noise, distance)
    solve(S, W, 3)
    for a in range(len(columns)):
        at = 3 * columns[a]
        for i in range(3):
            for k in range(3):
                for m in range(3):
                    WH[row + i, at + k] += W[i, m] * H[row + m, at + k]
    for i in range(3):
        for m in range(3):
            Wr[row + i] += W[i, m] * residual[m]
    return distance


@compiled
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
    for i in range(moving):
        vector[size + i] -= tau * g[i]
        for k in range(size):
            information[size + i, k] -= tau * G[i, k]
            information[k, size + i] -= tau * G[i, k]
        for k in range(moving):
            information[size + i, size + k] += tau * tau * G[i, k]
