"""Joint angles and their rates from the rotations of a body's links.

The inverse of the chain of :mod:`pose_core.body.kinematics`, link by link.
"""

import numpy as np

from pose_core.body.kinematics import moved_axes
from pose_core.body.model import Link
from pose_core.kernels import joint_angle_extraction
from pose_core.streams.samples import FloatArray

FULL_TURN = joint_angle_extraction.FULL_TURN


def link_angles(link: Link, R_parent_link: FloatArray, previous: FloatArray) -> FloatArray:
    """A link's joint angles.

    Args:
        link: With three degrees of freedom (about ∓y, ±x, ∓z), two (y, x) or one (∓y).
        R_parent_link: The link's rotation in its parent, shape (3, 3).
        previous: The angles before [rad], shape (degrees of freedom,), from which the equivalent
            answers are told apart, see
            :func:`pose_core.kernels.joint_angle_extraction.link_angles`.

    Returns:
        Angles [rad], shape (degrees of freedom,).
    """
    angles = np.empty(len(link.dof))
    signs = np.array([float(sum(dof.axis)) for dof in link.dof])
    limits = np.array([[dof.lower, dof.upper] for dof in link.dof])
    joint_angle_extraction.link_angles(
        np.ascontiguousarray(R_parent_link), signs, limits, np.array(previous, float), angles
    )
    return angles


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
    rates = np.empty((len(link.dof), 1))
    omega = np.array(omega_map, float).reshape(3, 1)
    joint_angle_extraction.least_squares(
        moved_axes(R_map_parent, axes, angles), omega, joint_angle_extraction.RATE_DAMPING, rates
    )
    return rates[:, 0]


def continuous_vector(vector: FloatArray, previous: FloatArray) -> FloatArray:
    """The rotation vector of the same rotation that lies nearest to the previous one.

    Args:
        vector: Rotation vector [rad], shape (3,).
        previous: The one before, of any length.
    """
    result = np.empty(3)
    joint_angle_extraction.continuous_vector(
        np.array(vector, float), np.array(previous, float), result
    )
    return result
