"""``zhang2015``: weighted mean of one Kinect and the IMUs, as printed in the paper.

The first sensor's skeleton gives the direction of each limb, its IMU the full attitude. Both are
weighted by (12) and (13). The rotation about the limb's long axis, which the Kinect does not
measure, comes from the IMU. While a joint of the limb is inferred or not tracked, the weights are
(0, 1); they change back immediately. Nothing is filtered.

The paper does not say how the attitude of an IMU is converted to that of its limb; here the
sensor-to-segment alignment of :mod:`pose_core.imu.attitude_aligner` is used. The mean of two
attitudes is taken along the shortest rotation between them instead of angle by angle, which avoids
singularities. For the paper's attitudes the IMU bridge runs Madgwick's filter
(``filter: madgwick``).

Both measure one attitude with independent noise of variance σ₁² (Kinect) and σ₂² (IMU); the
unbiased weights of minimum variance are w₁ = σ₂²/(σ₁²+σ₂²), w₂ = σ₁²/(σ₁²+σ₂²).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.body.inverse_kinematics import vector_from_rotation
from pose_core.body.joint_rotations import continuous_vector, link_angles
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import ROOT_DOF, Link
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import FusedPose
from pose_core.estimators.estimator import StepwiseEstimator
from pose_core.estimators.pose_of_joints import MAX_STEP_S, PoseOfJoints
from pose_core.imu.attitude_aligner import AttitudeAligner
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_to_segment import SensorToSegment
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_core.kernels.published_state import Source
from pose_core.stamps import NS_PER_S

BALL_JOINT = 3  # degrees of freedom; the last one is the axial rotation
KINECT_STDDEV = 0.05  # [rad] σ₁ of a limb's attitude; with σ₂, the paper's weights 0.8 and 0.2
IMU_STDDEV = 0.1  # [rad] σ₂
NEARLY_PARALLEL = 1e-9


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Weights of the two sources, and the variance of their weighted mean."""

    kinect: float
    imu: float
    variance: float  # [rad²]


def minimum_variance_weights(
    kinect_variance: float, imu_variance: float, *, is_tracked: bool
) -> Weights:
    """Minimum-variance weights of the two attitudes.

    Args:
        kinect_variance: σ₁² [rad²].
        imu_variance: σ₂² [rad²].
        is_tracked: Whether the Kinect tracks the joints that define the segment.
    """
    if not is_tracked:
        return Weights(kinect=0.0, imu=1.0, variance=imu_variance)
    total = kinect_variance + imu_variance
    return Weights(
        kinect=imu_variance / total,  # zhang2015 (12)
        imu=kinect_variance / total,  # zhang2015 (13)
        variance=kinect_variance * imu_variance / total,
    )


def fuse_trunk(R_kinect: FloatArray, R_imu: FloatArray, imu_weight: float) -> FloatArray:
    """Weighted mean of two full rotations of a segment, shape (3, 3).

    The mean lies on the shortest rotation from one to the other.
    """
    turn = Rotation.from_matrix(R_kinect.T @ R_imu).as_rotvec()
    return R_kinect @ Rotation.from_rotvec(imu_weight * turn).as_matrix()


def fuse_limb(R_kinect: FloatArray, R_imu: FloatArray, imu_weight: float) -> FloatArray:
    """Weighted mean of a limb's direction, with the axial rotation of the IMU, shape (3, 3).

    The IMU's rotation is followed by the smallest rotation that brings its long axis, z, to the
    mean direction.
    """
    axis = np.cross(R_imu[:, 2], R_kinect[:, 2])
    sine, cosine = float(np.linalg.norm(axis)), float(R_imu[:, 2] @ R_kinect[:, 2])
    if sine < NEARLY_PARALLEL:  # equal or opposite: use the IMU's
        return R_imu
    angle = np.arctan2(sine, cosine)
    return Rotation.from_rotvec((1.0 - imu_weight) * angle * axis / sine).as_matrix() @ R_imu


class Zhang2015Estimator(StepwiseEstimator):
    """Weighted mean of one Kinect and the IMUs at each frame of the Kinect."""

    NEEDS_ALIGNED_FRAMES = False
    USES_IMUS = True

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._raw = PoseOfJoints(self.model, self.shape)
        self._kinematics = ForwardKinematics(self.model, self.shape.offsets)
        self._imus = AttitudeAligner(self.model)
        self._previous: tuple[int, FusedPose] | None = None

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """State of use of each IMU with samples."""
        return self._imus.uses

    def use_sensor_to_segment(self, alignments: Mapping[str, SensorToSegment]) -> None:
        """Use sensor-to-segment rotations of a calibration."""
        self._imus.use_sensor_to_segment(alignments)

    def update(self, observation: Observation) -> FusedPose | None:
        """The fused pose at a frame of the first sensor; None at frames of the others."""
        if not observation.tracking_state[0].any():
            return None
        pose = self._raw.at(
            observation.stamp_ns, observation.positions[0], observation.tracking_state.max(axis=0)
        )
        if pose is None:
            return None
        self._imus.observe(observation.stamp_ns, observation.imus, pose.rotations)
        attitudes = {
            self.model.segments[segment]: attitude
            for segment, attitude in self._imus.attitudes(observation.imus).items()
            if segment in self.model.segments
        }
        if attitudes:
            self._fuse(pose, observation, attitudes)
        self._previous = observation.stamp_ns, pose
        return pose

    def _fuse(
        self, pose: FusedPose, observation: Observation, attitudes: Mapping[str, FloatArray]
    ) -> None:
        """Replace the rotations of links that carry an IMU, and recompute all angles."""
        tracked = observation.tracking_state[0] == TrackingState.TRACKED
        weights: dict[str, Weights] = {}
        for index, link in enumerate(self.model.links.values()):
            attitude = attitudes.get(link.name)
            if attitude is None:
                continue
            ends = [JOINT_INDEX[joint] for joint in self.model.ends(link.name)]
            weights[link.name] = weight = minimum_variance_weights(
                KINECT_STDDEV**2, IMU_STDDEV**2, is_tracked=bool(tracked[ends].all())
            )
            mean = fuse_trunk if link.parent is None else fuse_limb
            pose.rotations[index] = mean(pose.rotations[index], attitude, weight.imu)
        before = pose.position if self._previous is None else self._previous[1].position
        pose.position[3:6] = continuous_vector(vector_from_rotation(pose.rotations[0]), before[3:6])
        for index, link in enumerate(self.model.links.values()):
            if link.name in weights or link.parent in weights:
                self._extract_angles(pose, index, link, weights.get(link.name), before)
        placed = self._kinematics.pose(pose.position)
        pose.rotations, pose.joints = placed.rotations, placed.positions
        if self._previous is not None:
            step_s = (observation.stamp_ns - self._previous[0]) / NS_PER_S
            if 0.0 < step_s <= MAX_STEP_S:
                pose.velocity = (pose.position - before) / step_s

    def _extract_angles(
        self, pose: FusedPose, index: int, link: Link, weight: Weights | None, before: np.ndarray
    ) -> None:
        """Compute one link's angles and, if it carries an IMU, their source."""
        if link.parent is None:
            dof = np.arange(3, ROOT_DOF)
        else:
            dof = np.array([self.model.dof_index[each.name] for each in link.dof])
            parent = pose.rotations[self.model.link_index[link.parent]]
            relative = parent.T @ pose.rotations[index]
            pose.position[dof] = link_angles(link, relative, before[dof])
        if weight is None:
            return
        pose.weight_kinect[dof], pose.weight_imu[dof] = weight.kinect, weight.imu
        pose.variance[dof] = weight.variance
        pose.source[dof] = Source.FUSED if weight.kinect > 0.0 else Source.IMU
        if len(dof) == BALL_JOINT and link.parent is not None:  # roll comes from the IMU only
            pose.weight_kinect[dof[-1]], pose.weight_imu[dof[-1]] = 0.0, 1.0
            pose.variance[dof[-1]] = IMU_STDDEV**2
            pose.source[dof[-1]] = Source.IMU
