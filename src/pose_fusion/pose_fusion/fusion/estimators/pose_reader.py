"""The degrees of freedom, their rates and their uncertainty, read off the links' rotations."""

from copy import copy

import numpy as np
from numpy.typing import NDArray

from pose_common.joints import JOINTS
from pose_fusion.body.hinge_plane import hinges_of
from pose_fusion.body.kinematics import model_numbers
from pose_fusion.body.model import BodyModel
from pose_fusion.body.segment_tree import SegmentTree
from pose_fusion.body.shape import BodyShape
from pose_fusion.filters.looks import UpdateReport
from pose_fusion.filters.segment_state import SegmentState
from pose_fusion.fusion.estimators.estimator import FusedPose
from pose_fusion.fusion.estimators.uncertainty import Trusts, numbers_of
from pose_fusion.kernels.gliding import Glide
from pose_fusion.kernels.telling import BodyAsTold, Told, tell
from pose_fusion.streams.samples import FloatArray

OWN_RATES = np.zeros(0)


class PoseReader:
    """Turns a segment filter's state into the model's degrees of freedom, continuously.

    Args:
        model: The body model.
        shape: The person's measures.
        tree: The body as the filter has it.
        trusts: How much the filter's variances are worth.
    """

    def __init__(
        self, model: BodyModel, shape: BodyShape, tree: SegmentTree, trusts: Trusts
    ) -> None:
        self._body = BodyAsTold(
            numbers=model_numbers(model, shape.offsets),
            hinges=hinges_of(tree),
            trusts=numbers_of(model, trusts),
        )
        self._previous = np.zeros(model.size)

    def copy(self) -> "PoseReader":
        """An independent one, which goes on from the same pose."""
        other = copy(self)
        other._previous = self._previous.copy()
        return other

    def read(
        self,
        state: SegmentState,
        glide: Glide,
        report: UpdateReport,
        scale: float,
        tracking_state: NDArray[np.uint8],
        rates: FloatArray = OWN_RATES,
    ) -> FusedPose:
        """The pose of a state.

        Args:
            state: Of the filter.
            glide: What still lies between it and what goes out.
            report: Of the update that led to it.
            scale: Of the variances [-].
            tracking_state: Of each sensor's joints, shape (sensors, 15).
            rates: Of the degrees of freedom, (d,), by which they may be late; its own if left out.
        """
        size = len(self._previous)
        told = Told(
            np.empty((5, size)),
            np.empty(size, np.uint8),
            np.empty(state.rotations.shape),
            np.empty((len(JOINTS), 3)),
            np.empty(tracking_state.shape),
        )
        tell(
            self._body,
            state.pose,
            glide,
            state.covariance,
            report.information,
            scale,
            rates,
            tracking_state,
            self._previous,
            told,
        )
        position, velocity, variance, weight_kinect, weight_imu = told.of_dof
        return FusedPose(
            position=position,
            velocity=velocity,
            variance=variance,
            weight_kinect=weight_kinect,
            weight_imu=weight_imu,
            source=told.source,
            rotations=told.rotations,
            joints=told.joints,
            sensor_weight=told.sensor_weight,
        )
