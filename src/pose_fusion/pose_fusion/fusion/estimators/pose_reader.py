"""The degrees of freedom, their rates and their uncertainty, read off the links' rotations."""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_fusion.body.joint_rotations import continuous_vector, link_angles, link_rates
from pose_fusion.body.kinematics import ForwardKinematics, moved_axes
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.filters.segment_filter import UpdateReport
from pose_fusion.filters.segment_state import Layout, SegmentState
from pose_fusion.fusion.estimates import Source
from pose_fusion.fusion.estimators.estimator import FusedPose
from pose_fusion.streams.samples import FloatArray

DAMPING = 0.1  # [-] of an angle's variance where two axes of a joint nearly coincide
NOTHING = 1e-6  # [1/rad²] information that is none


class PoseReader:
    """Turns a segment filter's state into the model's degrees of freedom, continuously.

    Args:
        model: The body model.
        shape: The person's measures.
    """

    def __init__(self, model: BodyModel, shape: BodyShape) -> None:
        self._model = model
        self._kinematics = ForwardKinematics(model, shape.offsets)
        self._layout = Layout(len(model.links), len(model.sliding))
        self._links = [
            (
                index,
                link,
                -1 if link.parent is None else model.link_names.index(link.parent),
                np.array([model.dof_index[dof.name] for dof in link.dof], int),
                np.array([dof.axis for dof in link.dof], float),
            )
            for index, link in enumerate(model.links.values())
        ]
        self._previous = np.zeros(model.size)

    def read(
        self, state: SegmentState, report: UpdateReport, sensor_weight: FloatArray
    ) -> FusedPose:
        """The pose of a state.

        Args:
            state: Of the filter.
            report: Of the update that led to it.
            sensor_weight: Each sensor's share in each joint, shape (sensors, 15).
        """
        size = self._model.size
        position, velocity, variance = np.empty(size), np.empty(size), np.empty(size)
        information = np.zeros((2, size))  # Kinect's and IMU's
        layout, P, R = self._layout, state.covariance, state.rotations
        for index, link, parent, dof, axes in self._links:
            own = layout.rotation(index)
            if parent < 0:
                vector = Rotation.from_matrix(R[index]).as_rotvec()
                position[3:6] = continuous_vector(vector, self._previous[3:6])
                velocity[3:6] = state.rates[index]
                variance[3:6] = np.diag(P[own, own])
                information[:, :6] = np.mean(np.diagonal(report.information[:, index], 0, 1, 2))
                continue
            angles = link_angles(link, R[parent].T @ R[index], self._previous[dof])
            position[dof] = angles
            omega = state.rates[index] - state.rates[parent]
            velocity[dof] = link_rates(link, R[parent], angles, omega)
            above = layout.rotation(parent)
            relative = P[own, own] + P[above, above] - P[own, above] - P[above, own]
            A = moved_axes(R[parent], axes, angles)  # (k, 3)
            inverse = np.linalg.solve(A @ A.T + DAMPING**2 * np.eye(len(dof)), A)
            variance[dof] = np.einsum("ka,ab,kb->k", inverse, relative, inverse)
            information[:, dof] = np.einsum("ka,sab,kb->sk", A, report.information[:, index], A)
        position[:3], velocity[:3] = state.position, state.velocity
        variance[:3] = np.diag(P)[layout.position]
        self._previous = position.copy()
        pose = self._kinematics.pose(position)
        weight, source = _shares(information)
        return FusedPose(
            position=position,
            velocity=velocity,
            variance=variance,
            weight_kinect=weight[0],
            weight_imu=weight[1],
            source=source,
            rotations=pose.rotations,
            joints=pose.positions,
            sensor_weight=sensor_weight,
        )


def _shares(information: FloatArray) -> "tuple[FloatArray, np.ndarray]":
    """Each source's share of what the update knew, and the name for it."""
    total = information.sum(axis=0)
    known = total > NOTHING
    share = np.where(known, information / np.where(known, total, 1.0), 0.0)
    has_kinect, has_imu = information > NOTHING
    source = np.select(
        [has_kinect & has_imu, has_kinect, has_imu],
        [Source.FUSED, Source.KINECT, Source.IMU],
        Source.PREDICTED,
    )
    return share, source.astype(np.uint8)
