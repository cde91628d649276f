"""What one camera's frame tells of joints: where each should be, where it is, and how surely."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.placing import (
    BodyNumbers,
    Pose,
    derivative,
    joint_velocities,
    place_joints,
)
from pose_core.kernels.small_matrices import (
    Symmetric,
    inverse,
    quadratic_form,
    scaled,
    symmetric,
)
from pose_core.kernels.tracker import (
    TrackerNumbers,
    foreshortening,
    inertia,
    noise_covariance,
    student_factor,
)
from pose_core.kernels.vectors import norm
from pose_core.streams.samples import FloatArray

INFERRED = 1  # of TrackingState


class Frame(NamedTuple):
    """One camera's frame: a row of them."""

    positions: FloatArray
    tracking_state: NDArray[np.uint8]
    camera: FloatArray
    offsets: FloatArray
    delay_s: float


class Joints(NamedTuple):
    """What a camera should see of n joints, and what it sees instead; those unseen: zeros in H."""

    levers: FloatArray  # (n, links, 3), see kernels.placing
    places: FloatArray  # (n, 3) [m] in map
    velocity: FloatArray  # (n, 3) [m/s]
    rays: FloatArray  # (n, 3) unit vectors from the camera
    pointing: FloatArray  # (n,) see kernels.tracker.foreshortening
    H: FloatArray  # (3 n, size): derivatives of the places, three rows a joint
    R: FloatArray  # (n, 3, 3) [m²] noise
    residual: FloatArray  # (n, 3) [m]


@compiled
def make_joints(count: int, links: int, size: int) -> Joints:
    """Room for them."""
    return Joints(
        np.zeros((count, links, 3)),
        np.empty((count, 3)),
        np.empty((count, 3)),
        np.empty((count, 3)),
        np.empty(count),
        np.zeros((3 * count, size)),
        np.empty((count, 3, 3)),
        np.empty((count, 3)),
    )


@compiled_in_place
def expect_joints(
    body: BodyNumbers,
    limb_ends: NDArray[np.int64],
    frame: Frame,
    pose: Pose,
    position: FloatArray,
    rotations: FloatArray,
    joints: Joints,
) -> None:
    """Where the joints were, and how the camera looks at them; place and rotations are of then."""
    place_joints(body, position, rotations, pose.slides, joints.levers, joints.places)
    joint_velocities(body, joints.levers, pose.velocity, pose.rates, joints.velocity)
    for j in range(len(joints.rays)):
        ray = joints.rays[j]
        for axis in range(3):
            ray[axis] = joints.places[j, axis] - frame.camera[axis]
        length = norm(ray)
        for axis in range(3):
            ray[axis] /= length
    foreshortening(joints.places, joints.rays, limb_ends, joints.pointing)


@compiled_in_place
def compare_joints(
    body: BodyNumbers,
    noise: TrackerNumbers,
    frame: Frame,
    position: FloatArray,
    rotations: FloatArray,
    memory: FloatArray,
    joints: Joints,
) -> None:
    """Fill in H, R and the residual of each joint that is seen."""
    for j in range(len(memory)):
        if not is_seen(frame, j):
            continue
        is_inferred, pointing = frame.tracking_state[j] == INFERRED, joints.pointing[j]
        v, place = joints.velocity[j], joints.places[j]
        speed = norm(v)
        share = inertia(noise, speed, pointing, is_inferred)
        H = joints.H[3 * j : 3 * j + 3]
        derivative(body, j, joints.levers, rotations, 1.0 - share, H)
        residual = joints.residual[j]
        expected_residual(frame, j, place, position, memory[j], share, rotations[0], residual)
        noise_covariance(noise, joints.rays[j], v, speed, pointing, is_inferred, joints.R[j])


@compiled_in_place
def is_seen(frame: Frame, joint: int) -> bool:
    """Whether the camera says where a joint is."""
    return frame.tracking_state[joint] != 0 and np.isfinite(frame.positions[joint, 0])


@compiled_in_place
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


@compiled_in_place
def weigh_joints(
    body: BodyNumbers,
    noise: TrackerNumbers,
    frame: Frame,
    joints: Joints,
    HP: FloatArray,
    WH: FloatArray,
    Wr: FloatArray,
    distance: FloatArray,
) -> None:
    """Fill in the rows of those that are seen.

    Args:
        body: The tree.
        noise: The tracker's numbers.
        frame: What the camera saw.
        joints: What it should see.
        HP: H times the covariance.
        WH: Filled: W H, (3 n, size).
        Wr: Filled: W r, (3 n,).
        distance: Filled, (n,): squared Mahalanobis distances.
    """
    for j in range(len(distance)):
        if is_seen(frame, j):
            distance[j] = weigh_joint(body, noise, j, joints, HP, WH, Wr)


@compiled_in_place
def weigh_joint(
    body: BodyNumbers,
    noise: TrackerNumbers,
    joint: int,
    joints: Joints,
    HP: FloatArray,
    WH: FloatArray,
    Wr: FloatArray,
) -> float:
    """Fill in one joint's three rows; its squared distance."""
    H, R, residual = joints.H, joints.R[joint], joints.residual[joint]
    row = 3 * joint
    S = innovation_covariance(body, joint, H, HP, R)
    distance = quadratic_form(inverse(S), residual)
    W = inverse(scaled(symmetric(R), student_factor(noise, distance)))
    for k in range(H.shape[1]):
        x, y, z = H[row, k], H[row + 1, k], H[row + 2, k]
        WH[row, k] = W.xx * x + W.xy * y + W.xz * z
        WH[row + 1, k] = W.xy * x + W.yy * y + W.yz * z
        WH[row + 2, k] = W.xz * x + W.yz * y + W.zz * z
    x, y, z = residual[0], residual[1], residual[2]
    Wr[row] = W.xx * x + W.xy * y + W.xz * z
    Wr[row + 1] = W.xy * x + W.yy * y + W.yz * z
    Wr[row + 2] = W.xz * x + W.yz * y + W.zz * z
    return distance


@compiled_in_place
def innovation_covariance(
    body: BodyNumbers, joint: int, H: FloatArray, HP: FloatArray, R: FloatArray
) -> Symmetric:
    """H P Hᵀ + R of one joint, given H P and its R."""
    row = 3 * joint
    xx, xy, xz, yy, yz, zz = symmetric(R)
    for c in range(body.column_count[joint]):
        first = 3 * body.columns[joint, c]
        for k in range(first, first + 3):
            x, y, z = HP[row, k], HP[row + 1, k], HP[row + 2, k]
            u, v, w = H[row, k], H[row + 1, k], H[row + 2, k]
            xx += x * u
            xy += x * v
            xz += x * w
            yy += y * v
            yz += y * w
            zz += z * w
    return Symmetric(xx, xy, xz, yy, yz, zz)
