"""The Kinects' links and the IMUs' segments, made one pose: zhang2015 on a tree.

The filter's links are the Kinects' attitudes. Each link that carries an aligned IMU is replaced by
the weighted mean of both, and the joint angles are read off the links again.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_core.body.joint_rotations import continuous_vector, link_angles, link_rates
from pose_core.body.model import ROOT_DOF, BodyModel, Link
from pose_core.filters.li2020 import Li2020Filter
from pose_core.fusion.estimates import Source
from pose_core.fusion.pose_block import FusedPose
from pose_core.imu.readings import SegmentReading
from pose_core.imu.switching import OcclusionDetector, SteplessCorrection
from pose_core.imu.weighting import (
    ZHANG2015_KINECT,
    Weights,
    fixed_weights,
    fuse_limb,
    fuse_trunk,
    minimum_variance_weights,
)
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_core.streams.samples import FloatArray

BALL_JOINT = 3  # degrees of freedom, of which the last turns the limb about itself


class BodyFusion:
    """Combines one filter's state with the readings of aligned IMUs.

    Args:
        model: The body model.
        kinect_joint_stddev: Slow error of a tracked joint [m], beyond the filter's covariance.
        imu_mounting_stddev: Error of an IMU's alignment [rad], beyond its own.
        has_fixed_weights: Whether the weights are zhang2015's 0.8 and 0.2, not those of least
            variance.
    """

    def __init__(
        self,
        model: BodyModel,
        kinect_joint_stddev: float,
        imu_mounting_stddev: float,
        has_fixed_weights: bool = False,
    ) -> None:
        self._model = model
        self._kinect_joint_stddev = kinect_joint_stddev
        self._imu_mounting_stddev = imu_mounting_stddev
        self._has_fixed_weights = has_fixed_weights
        self._previous: FloatArray | None = None
        self._detectors: dict[str, OcclusionDetector] = {}
        self._corrections: dict[str, SteplessCorrection] = {}

    def reset(self) -> None:
        """Forget the previous pose: the filter starts anew."""
        self._previous = None

    def fuse(
        self,
        filtered: Li2020Filter,
        tracking_state: NDArray[np.uint8],
        readings: Mapping[str, SegmentReading],
        sensor_weight: FloatArray,
    ) -> FusedPose:
        """The pose at the filter's instant.

        Args:
            filtered: The filter, just updated.
            tracking_state: Best state of each joint over the sensors, shape (15,).
            readings: What the aligned IMUs say, by segment.
            sensor_weight: Each sensor's share in each joint, shape (sensors, 15).
        """
        fused = self._from_filter(filtered, tracking_state, sensor_weight)
        by_link = {
            self._model.segments[segment]: reading
            for segment, reading in readings.items()
            if segment in self._model.segments
        }
        if by_link:
            weights = self._weight_links(fused, filtered, tracking_state, by_link)
            self._read_angles(fused, weights)
            self._read_rates(fused, filtered, by_link)
            self._place_joints(fused, filtered)
        else:
            self._corrections.clear()
        if self._previous is not None:
            fused.position[3:6] = continuous_vector(fused.position[3:6], self._previous[3:6])
        self._previous = fused.position.copy()
        return fused

    def _from_filter(
        self,
        filtered: Li2020Filter,
        tracking_state: NDArray[np.uint8],
        sensor_weight: FloatArray,
    ) -> FusedPose:
        model = self._model
        pose = filtered.kinematics.pose(filtered.dof)
        position = filtered.dof.copy()
        position[3:6] = Rotation.from_matrix(pose.rotations[0]).as_rotvec()
        seen = np.full(model.size, np.any(tracking_state > TrackingState.NOT_TRACKED))
        for name, link_name in model.link_of_dof.items():
            end = self._ends(model.links[link_name])[1]
            seen[model.dof_index[name]] &= tracking_state[end] > TrackingState.NOT_TRACKED
        return FusedPose(
            position=position,
            velocity=filtered.rates.copy(),
            variance=np.diag(filtered.covariance).copy(),
            weight_kinect=seen.astype(float),
            weight_imu=np.zeros(model.size),
            source=np.where(seen, Source.KINECT, Source.PREDICTED).astype(np.uint8),
            rotations=pose.rotations,
            joints=pose.positions,
            sensor_weight=sensor_weight,
        )

    def _weight_links(
        self,
        fused: FusedPose,
        filtered: Li2020Filter,
        tracking_state: NDArray[np.uint8],
        readings: Mapping[str, SegmentReading],
    ) -> dict[str, Weights]:
        jacobian = filtered.kinematics.jacobian(filtered.dof)
        weights = {}
        for index, link in enumerate(self._model.links.values()):
            reading = readings.get(link.name)
            if reading is None:
                self._corrections.pop(link.name, None)
                continue
            ends = list(self._ends(link))
            bone = fused.joints[ends[1]] - fused.joints[ends[0]]
            spread = jacobian[ends[1]] - jacobian[ends[0]]
            kinect_variance = (
                0.5 * np.trace(spread @ filtered.covariance @ spread.T)
                + 2.0 * self._kinect_joint_stddev**2
            ) / (bone @ bone)
            weights[link.name] = self._weight_link(
                link,
                (fused.rotations[index], float(kinect_variance)),
                reading,
                is_tracked=bool(np.all(tracking_state[ends] == TrackingState.TRACKED)),
            )
            mean = fuse_trunk if link.parent is None else fuse_limb
            kinect, imu = fused.rotations[index], reading.R_map_segment
            fused.rotations[index] = self._corrections.setdefault(
                link.name, SteplessCorrection()
            ).apply(kinect, imu, mean(kinect, imu, weights[link.name].imu))
        return weights

    def _weight_link(
        self,
        link: Link,
        kinect: tuple[FloatArray, float],
        reading: SegmentReading,
        *,
        is_tracked: bool,
    ) -> Weights:
        """Weights of one link, whose Kinect gives a rotation and its variance [rad²]."""
        (R_kinect, kinect_variance), R_imu = kinect, reading.R_map_segment
        imu_variance = float(np.mean(reading.stddev**2)) + self._imu_mounting_stddev**2
        if is_tracked:
            cosine = float(np.clip(R_kinect[:, 2] @ R_imu[:, 2], -1.0, 1.0))
            # Of a direction, two axes of both.
            expected = 2.0 * (kinect_variance + imu_variance)
            detector = self._detectors.setdefault(link.name, OcclusionDetector())
            is_tracked = not detector.update(float(np.arccos(cosine)), expected)
        if self._has_fixed_weights:
            return fixed_weights(
                kinect_variance, imu_variance, is_tracked=is_tracked, kinect=ZHANG2015_KINECT
            )
        return minimum_variance_weights(kinect_variance, imu_variance, is_tracked=is_tracked)

    def _read_angles(self, fused: FusedPose, weights: Mapping[str, Weights]) -> None:
        """Joint angles from the links, with the weights that made them."""
        model = self._model
        before = fused.position.copy() if self._previous is None else self._previous
        fused.position[3:6] = Rotation.from_matrix(fused.rotations[0]).as_rotvec()
        for index, link in enumerate(model.links.values()):
            weight = weights.get(link.name)
            if link.parent is None:
                which = np.arange(3, ROOT_DOF)
            else:
                which = np.array([model.dof_index[dof.name] for dof in link.dof])
                parent = fused.rotations[model.link_names.index(link.parent)]
                if weight is not None or link.parent in weights:
                    fused.position[which] = link_angles(
                        link, parent.T @ fused.rotations[index], before[which]
                    )
            if weight is None:
                continue
            fused.weight_kinect[which], fused.weight_imu[which] = weight.kinect, weight.imu
            fused.variance[which] = weight.variance
            if link.parent is not None and link.parent in weights:
                fused.variance[which] += weights[link.parent].variance
            fused.source[which] = Source.FUSED if weight.kinect > 0.0 else Source.IMU
            if len(which) == BALL_JOINT and link.parent is not None:
                # zhang2015: what turns about the limb's own axis is the IMU's alone.
                fused.weight_kinect[which[-1]], fused.weight_imu[which[-1]] = 0.0, 1.0
                fused.source[which[-1]] = Source.IMU

    def _read_rates(
        self,
        fused: FusedPose,
        filtered: Li2020Filter,
        readings: Mapping[str, SegmentReading],
    ) -> None:
        """Rates from the gyroscopes, where a link or its parent carries one."""
        model = self._model
        omega = filtered.kinematics.angular_velocities(filtered.dof, filtered.rates)
        for index, name in enumerate(model.link_names):
            if name in readings:
                omega[index] = readings[name].angular_velocity
        for index, link in enumerate(model.links.values()):
            if link.parent is None:
                fused.velocity[3:6] = omega[index]
            elif link.name in readings or link.parent in readings:
                parent = model.link_names.index(link.parent)
                which = np.array([model.dof_index[dof.name] for dof in link.dof])
                fused.velocity[which] = link_rates(
                    link,
                    fused.rotations[parent],
                    fused.position[which],
                    omega[index] - omega[parent],
                )

    def _place_joints(self, fused: FusedPose, filtered: Li2020Filter) -> None:
        """Joints and links of the pose that the model can take."""
        kinematics = filtered.kinematics
        dof = fused.position.copy()
        dof[3:6] = Rotation.from_matrix(fused.rotations[0] @ kinematics.R_reference.T).as_rotvec()
        pose = kinematics.pose(dof)
        fused.rotations, fused.joints = pose.rotations, pose.positions

    def _ends(self, link: Link) -> tuple[int, int]:
        start, end = self._model.ends(link.name)
        return JOINT_INDEX[start], JOINT_INDEX[end]
