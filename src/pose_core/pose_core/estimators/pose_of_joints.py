"""Degrees of freedom from joint positions, for methods that estimate only positions."""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.inverse_kinematics import dof_from_positions, vector_from_rotation
from pose_core.body.joint_rotations import continuous_dof
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.body.trunk import trunk_axes
from pose_core.estimates.body_estimates import Source
from pose_core.estimates.poses import FusedPose
from pose_core.stamps import NS_PER_S

LONGEST_STEP_S = 0.5  # [s] longest time over which differences give rates


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
        if not np.all(np.isfinite(trunk_axes(known))):
            return None
        self._known = known
        position = dof_from_positions(self._model, known)
        position[3:6] = vector_from_rotation(trunk_axes(known))
        velocity = np.zeros(self._model.size)
        if self._position is not None:
            position = continuous_dof(position, self._position)
            step_s = (stamp_ns - self._stamp_ns) / NS_PER_S
            if 0.0 < step_s <= LONGEST_STEP_S:
                velocity = (position - self._position) / step_s
        self._position, self._stamp_ns = position, stamp_ns
        seen = np.isfinite(joints).all(axis=1).any()
        size = self._model.size
        return FusedPose(
            position=position.copy(),
            velocity=velocity,
            variance=np.full(size, np.nan),
            weight_kinect=np.full(size, float(seen)),
            weight_imu=np.zeros(size),
            source=np.full(size, Source.KINECT if seen else Source.PREDICTED, np.uint8),
            rotations=self._kinematics.pose(position).rotations,
            joints=joints.copy(),
            tracking_state=tracking_state,
        )
