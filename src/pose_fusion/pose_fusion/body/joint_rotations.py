"""Joint angles and their rates from the rotations of a body's links.

The inverse of the chain of :mod:`pose_fusion.body.kinematics`, link by link.
"""

import numpy as np

from pose_fusion.body.kinematics import moved_axes
from pose_fusion.body.model import Link
from pose_fusion.streams.samples import FloatArray

DAMPING = 0.05  # [-] of the rates where two axes of a joint nearly coincide
FULL_TURN = 2.0 * np.pi


def link_angles(link: Link, R_parent_link: FloatArray, previous: FloatArray) -> FloatArray:
    """A link's joint angles.

    Args:
        link: With three degrees of freedom (about ∓y, ±x, ∓z), two (y, x) or one (∓y).
        R_parent_link: The link's rotation in its parent, shape (3, 3).
        previous: The angles before, shape (degrees of freedom,) [rad]: of the equivalent answers
            the nearest is taken, so that no angle jumps by 2π.

    Returns:
        Angles [rad], shape (degrees of freedom,).
    """
    R = R_parent_link
    signs = np.array([sum(dof.axis) for dof in link.dof])
    if len(link.dof) == 1:
        # Between the two bones, as a camera would measure it; never negative.
        angle = np.arctan2(np.hypot(R[0, 2], R[1, 2]), R[2, 2])
        return np.array([angle])
    about_y = np.arctan2(R[0, 2], R[2, 2])
    about_x = np.arcsin(np.clip(-R[1, 2], -1.0, 1.0))
    if len(link.dof) == 2:
        candidates = [np.array([about_y, about_x])]
    else:
        about_z = np.arctan2(R[1, 0], R[1, 1])
        candidates = [
            np.array([about_y, about_x, about_z]),
            np.array([about_y + np.pi, np.pi - about_x, about_z + np.pi]),
        ]
    answers = [_nearest_turn(candidate * signs, previous) for candidate in candidates]
    return min(answers, key=lambda answer: float(np.sum((answer - previous) ** 2)))


def link_rates(
    link: Link, R_map_parent: FloatArray, angles: FloatArray, omega_map: FloatArray
) -> FloatArray:
    """Rates of a link's joint angles.

    Args:
        link: Any link with degrees of freedom.
        R_map_parent: The parent's rotation, shape (3, 3).
        angles: The joint angles [rad].
        omega_map: Angular velocity of the link relative to its parent, in map, shape (3,) [rad/s].

    Returns:
        Rates [rad/s]; damped least squares where the axes are nearly dependent.
    """
    axes = np.array([dof.axis for dof in link.dof], dtype=float)
    A = moved_axes(R_map_parent, axes, angles).T
    normal = A.T @ A + DAMPING**2 * np.eye(len(link.dof))
    return np.asarray(np.linalg.solve(normal, A.T @ omega_map))


def continuous_vector(vector: FloatArray, previous: FloatArray) -> FloatArray:
    """The rotation vector of the same rotation that lies nearest to the previous one.

    Args:
        vector: Rotation vector [rad], shape (3,).
        previous: The one before, of any length.
    """
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        # Any direction will do for full turns: keep the previous one's.
        length = float(np.linalg.norm(previous))
        turns = round(length / FULL_TURN)
        return previous / length * turns * FULL_TURN if turns else vector
    direction = vector / angle
    turns = round((float(direction @ previous) - angle) / FULL_TURN)
    return (angle + turns * FULL_TURN) * direction


def _nearest_turn(angles: FloatArray, previous: FloatArray) -> FloatArray:
    return angles + FULL_TURN * np.round((previous - angles) / FULL_TURN)
