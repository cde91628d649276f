"""Joint angles from the rotations of a body's links.

The inverse of the chain of :mod:`pose_core.body.kinematics`, link by link.
"""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import ROOT_DOF, Link
from pose_core.kernels import joint_angle_extraction


def link_angles(link: Link, R_parent_link: FloatArray, previous: FloatArray) -> FloatArray:
    """Extract a link's joint angles.

    Args:
        link: With three degrees of freedom (about ∓y, ±x, ∓z), two (y, x) or one (∓y).
        R_parent_link: The link's rotation in its parent, shape (3, 3).
        previous: The previous angles [rad], shape (degrees of freedom,), which select one of the
            equivalent solutions, see
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


def continuous_vector(vector: FloatArray, previous: FloatArray) -> FloatArray:
    """The rotation vector of the same rotation that lies nearest to the previous one.

    Args:
        vector: Rotation vector [rad], shape (3,).
        previous: The previous vector, of any length.
    """
    result = np.empty(3)
    joint_angle_extraction.continuous_vector(
        np.array(vector, float), np.array(previous, float), result
    )
    return result


def continuous_dof(dof: FloatArray, previous: FloatArray) -> FloatArray:
    """The same pose with the root's rotation vector and the angles nearest to the previous ones.

    Args:
        dof: The degrees of freedom, shape (d,), the root's first.
        previous: Those of the previous instant.
    """
    result = dof.copy()
    result[3:ROOT_DOF] = continuous_vector(dof[3:ROOT_DOF], previous[3:ROOT_DOF])
    full_turn = joint_angle_extraction.FULL_TURN
    result[ROOT_DOF:] += full_turn * np.round((previous - dof)[ROOT_DOF:] / full_turn)
    return result
