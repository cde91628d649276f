"""The degrees of freedom, their rates and their uncertainty, read off the links' rotations."""

from copy import copy

import numpy as np

from pose_common.joints import JOINTS
from pose_fusion.body.hinge_plane import hinges_of
from pose_fusion.body.kinematics import model_numbers
from pose_fusion.body.model import BodyModel
from pose_fusion.body.segment_tree import SegmentTree
from pose_fusion.body.shape import BodyShape
from pose_fusion.filters.looks import UpdateReport
from pose_fusion.filters.segment_state import SegmentState
from pose_fusion.fusion.estimators.estimator import FusedPose
from pose_fusion.kernels.reading import read_body
from pose_fusion.streams.samples import FloatArray

NOTHING = 1e-6  # [1/rad²] information that is none


class PoseReader:
    """Turns a segment filter's state into the model's degrees of freedom, continuously.

    Args:
        model: The body model.
        shape: The person's measures.
        tree: The body as the filter has it.
    """

    def __init__(self, model: BodyModel, shape: BodyShape, tree: SegmentTree) -> None:
        self._numbers = model_numbers(model, shape.offsets)
        self._hinges = hinges_of(tree)
        self._previous = np.zeros(model.size)

    def copy(self) -> "PoseReader":
        """An independent one, which goes on from the same pose."""
        other = copy(self)
        other._previous = self._previous.copy()
        return other

    def read(
        self, state: SegmentState, report: UpdateReport, sensor_weight: FloatArray
    ) -> FusedPose:
        """The pose of a state.

        Args:
            state: Of the filter.
            report: Of the update that led to it.
            sensor_weight: Each sensor's share in each joint, shape (sensors, 15).
        """
        size = len(self._previous)
        read, source = np.empty((5, size)), np.empty(size, np.uint8)
        rotations, joints = np.empty_like(state.rotations), np.empty((len(JOINTS), 3))
        read_body(
            self._numbers,
            self._hinges,
            state.pose,
            state.covariance,
            report.information,
            NOTHING,
            self._previous,
            read,
            source,
            rotations,
            joints,
        )
        position, velocity, variance, weight_kinect, weight_imu = read
        return FusedPose(
            position=position,
            velocity=velocity,
            variance=variance,
            weight_kinect=weight_kinect,
            weight_imu=weight_imu,
            source=source,
            rotations=rotations,
            joints=joints,
            sensor_weight=sensor_weight,
        )
