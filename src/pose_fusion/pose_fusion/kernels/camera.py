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
    G = np.zeros((pose_size, pose_size))
    g, rows = np.zeros(pose_size), np.empty((3, pose_size))
    H = np.empty((body.columns.shape[1], 3, 3))
    R, residual = np.empty((3, 3)), np.empty(3)
    for j in range(joint_count):
        if frame.tracking_state[j] == 0 or not np.isfinite(frame.positions[j, 0]):
            continue
        is_inferred = frame.tracking_state[j] == INFERRED
        v = velocity[j]
        speed = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
        share = inertia(noise, speed, pointing[j], is_inferred)
        derivative(body, j, levers, rotations, 1.0 - share, H)
        expected_residual(frame, j, joints[j], position, memory[j], share, rotations[0], residual)
        noise_covariance(noise, rays[j], v, speed, pointing[j], is_inferred, R)
        distance[j] = add_joint(body, noise, j, H, R, residual, spread, rows, G, g)
    add_delayed(G, g, tau, 3 + 3 * links, information, vector)


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
    out[:] = P[:size, :size]
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
def add_joint(
    body: BodyNumbers,
    noise: TrackerNumbers,
    joint: int,
    H: FloatArray,
    R: FloatArray,
    residual: FloatArray,
    P: FloatArray,
    rows: FloatArray,
    G: FloatArray,
    g: FloatArray,
) -> float:
    """Add one joint to G and to g; returns its squared distance.

    ``rows``, (3, len(P)), is room for H P and then for W H: whole rows, for a CPU takes several of
    their numbers at once.
    """
    count, columns = body.column_count[joint], body.columns[joint]
    S, W, solved = np.empty((3, 3)), np.zeros((3, 3)), np.empty((3, 1))
    add_rows(H, columns[:count], P, rows)
    for i in range(3):
        for k in range(3):
            S[i, k] = R[i, k]
            for a in range(count):
                at = 3 * columns[a]
                for m in range(3):
                    S[i, k] += rows[i, at + m] * H[a, k, m]
        solved[i, 0], W[i, i] = residual[i], 1.0
    solve(S, solved, 3)
    distance = 0.0
    for axis in range(3):
        distance += residual[axis] * solved[axis, 0]
    factor = student_factor(noise, distance)
    for i in range(3):
        for k in range(3):
            S[i, k] = R[i, k] * factor
    solve(S, W, 3)
    rows[:] = 0.0
    for b in range(count):
        at = 3 * columns[b]
        for i in range(3):
            for k in range(3):
                for m in range(3):
                    rows[i, at + k] += W[i, m] * H[b, m, k]
    for a in range(count):
        for k in range(3):
            row = G[3 * columns[a] + k]
            x, y, z = H[a, 0, k], H[a, 1, k], H[a, 2, k]
            for at in range(len(row)):
                row[at] += x * rows[0, at] + y * rows[1, at] + z * rows[2, at]
    for at in range(len(g)):
        for m in range(3):
            g[at] += rows[m, at] * residual[m]
    return distance


@compiled
def add_rows(H: FloatArray, columns: NDArray[np.int64], P: FloatArray, out: FloatArray) -> None:
    """H P, (3, len(P)), with H given by blocks of three columns."""
    for i in range(3):
        row = out[i]
        row[:] = 0.0
        for a in range(len(columns)):
            x, y, z = H[a, i, 0], H[a, i, 1], H[a, i, 2]
            first, second = P[3 * columns[a]], P[3 * columns[a] + 1]
            third = P[3 * columns[a] + 2]
            for at in range(len(row)):
                row[at] += x * first[at] + y * second[at] + z * third[at]


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
