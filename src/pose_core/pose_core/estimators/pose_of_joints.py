"""Degrees of freedom from joint positions, for methods that estimate only positions."""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.inverse_kinematics import dof_in_map
from pose_core.body.joint_rotations import continuous_dof
from pose_core.body.kinematics import BodyPose, ForwardKinematics
from pose_core.body.model import ROOT_DOF, BodyModel
from pose_core.body.shape import BodyShape
from pose_core.estimates.poses import FusedPose, pose_by_cameras
from pose_core.finite_numbers import are_known
from pose_core.stamps import NS_PER_S

MAX_STEP_S = 0.5  # [s] longest time over which differences give rates


class PoseOfJoints:
    """Computes continuous degrees of freedom from a sequence of joint positions.

    Args:
        model: The body model.
        shape: The person's body measures, for the links' frames.
    """

    def __init__(self, model: BodyModel, shape: BodyShape) -> None:
        self._model = model
        self._kinematics = ForwardKinematics(model, shape.offsets)
        self._known: FloatArray | None = None
        self._position: FloatArray | None = None
        self._stamp_ns = 0

    def at(
        self, stamp_ns: int, joints: FloatArray, tracking_state: NDArray[np.uint8]
    ) -> FusedPose | None:
        """Compute the pose of one instant.

        Args:
            stamp_ns: The instant.
            joints: Shape (15, 3) [m] in map. If a joint is NaN (unseen), its last position is
                used.
            tracking_state: Of the joints, shape (15,).

        Returns:
            None until the trunk has been seen. Variances are NaN, because they are unknown.
        """
        known = (
            joints if self._known is None else np.where(np.isfinite(joints), joints, self._known)
        )
        position = dof_in_map(self._model, known)
        if not np.isfinite(position[:ROOT_DOF]).all():
            return None
        self._known = known
        velocity = np.zeros(self._model.size)
        if self._position is not None:
            position = continuous_dof(position, self._position)
            step_s = (stamp_ns - self._stamp_ns) / NS_PER_S
            if 0.0 < step_s <= MAX_STEP_S:
                velocity = (position - self._position) / step_s
        self._position, self._stamp_ns = position, stamp_ns
        body = BodyPose(
            rotations=self._kinematics.pose(position).rotations, positions=joints.copy()
        )
        unknown, is_seen = np.full(self._model.size, np.nan), bool(are_known(joints).any())
        return pose_by_cameras(position, velocity, unknown, is_seen, body, tracking_state)
