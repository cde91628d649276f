"""The degrees of freedom, their rates and their uncertainty, read off the links' rotations."""

import numpy as np

from pose_common.joints import JOINTS
from pose_fusion.body.kinematics import model_numbers
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.filters.looks import UpdateReport
from pose_fusion.filters.segment_state import SegmentState
from pose_fusion.fusion.estimators.estimator import FusedPose
from pose_fusion.kernels.forward import place_links
from pose_fusion.kernels.reading import read_pose, share_out
from pose_fusion.streams.samples import FloatArray

NOTHING = 1e-6  # [1/rad²] information that is none


class PoseReader:
    """Turns a segment filter's state into the model's degrees of freedom, continuously.

    Args:
        model: The body model.
        shape: The person's measures.
    """

    def __init__(self, model: BodyModel, shape: BodyShape) -> None:
        self._numbers = model_numbers(model, shape.offsets)
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
        read = np.empty((5, len(self._previous)))
        information = np.ascontiguousarray(report.information)
        read_pose(self._numbers, state.pose, state.covariance, information, self._previous, read)
        position = read[0]
        self._previous = position.copy()
        rotations, joints = np.empty_like(state.rotations), np.empty((len(JOINTS), 3))
        place_links(self._numbers, np.eye(3), position[None], rotations[None], joints[None])
        weight, source = np.empty_like(read[3:]), np.empty(len(position), np.uint8)
        share_out(read[3:], NOTHING, weight, source)
        return FusedPose(
            position=position,
            velocity=read[1],
            variance=read[2],
            weight_kinect=weight[0],
            weight_imu=weight[1],
            source=source,
            rotations=rotations,
            joints=joints,
            sensor_weight=sensor_weight,
        )
