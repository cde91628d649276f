"""An estimate's messages as bytes, without making the messages: what takes most of a bag's time."""

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import Typestore
from scipy.spatial.transform import Rotation

from pose_common.joints import JOINT_INDEX
from pose_fusion.body.model import ROOT_DOF, BodyModel
from pose_fusion.conversions import (
    STATE_COLORS,
    bone_ends,
    tf_places,
    to_bag_message,
    to_messages,
)
from pose_fusion.fusion.estimates import BodyEstimate
from pose_fusion.streams.message_template import MessageTemplate
from pose_fusion.streams.samples import FloatArray


class EstimateBytes:
    """The bytes of :func:`pose_fusion.conversions.to_messages`, for one person and model.

    Args:
        model: The body model of all estimates.
        body_id: The person's id.
        typestore: Definitions of the messages.
        first: Any estimate: its messages give the form of all.
    """

    def __init__(
        self, model: BodyModel, body_id: str, typestore: Typestore, first: BodyEstimate
    ) -> None:
        self._model = model
        self._body_id = body_id
        messages = {
            topic: to_bag_message(message, typestore)
            for topic, message in to_messages(first, model, body_id, 0.0).items()
        }
        self.types = {topic: message.__msgtype__ for topic, message in messages.items()}
        self._templates = [MessageTemplate(message, typestore) for message in messages.values()]
        self._bones = np.array(
            [[JOINT_INDEX[name] for name in ends] for ends in bone_ends(model)]
        ).ravel()
        self._colors = np.ones((max(STATE_COLORS) + 1, 4), np.float32)
        for state, color in STATE_COLORS.items():
            self._colors[state, :3] = color
        markers = self._templates[3]
        # Each marker's own pose and scale come before its points.
        own = (len(markers.float64) - 3 * len(self._bones) - 3 * len(first.joints)) // 2
        self._bones_own = markers.float64[:own]
        self._balls_own = markers.float64[own + 3 * len(self._bones) :][:own]
        # The two markers' common colours come before those of the joints.
        self._common_colors = markers.float32[: -4 * len(first.joints)]

    def write(self, estimate: BodyEstimate, latency_s: float) -> dict[str, bytes]:
        """The messages' bytes by topic."""
        state = estimate.tracking_state
        numbers: tuple[
            tuple[FloatArray, NDArray[np.float32] | None, NDArray[np.uint8] | None], ...
        ] = (
            (
                np.concatenate([estimate.position[ROOT_DOF:], estimate.velocity[ROOT_DOF:]]),
                None,
                None,
            ),
            (estimate.joints.ravel(), None, state),
            (self._pose_estimate(estimate, latency_s), None, estimate.source),
            (self._markers(estimate), self._marker_colors(state), None),
            (self._transforms(estimate), None, None),
        )
        return {
            topic: template.fill(estimate.stamp_ns, *each)
            for topic, template, each in zip(self.types, self._templates, numbers, strict=True)
        }

    def _pose_estimate(self, estimate: BodyEstimate, latency_s: float) -> FloatArray:
        return np.concatenate(
            [
                estimate.position,
                estimate.velocity,
                estimate.position_stddev,
                estimate.weight_kinect,
                estimate.weight_imu,
                [latency_s],
            ]
        )

    def _markers(self, estimate: BodyEstimate) -> FloatArray:
        joints = estimate.joints
        parts = [self._bones_own, joints[self._bones].ravel(), self._balls_own, joints.ravel()]
        return np.concatenate(parts)

    def _marker_colors(self, state: NDArray[np.uint8]) -> NDArray[np.float32]:
        return np.concatenate([self._common_colors, self._colors[state].ravel()])

    def _transforms(self, estimate: BodyEstimate) -> FloatArray:
        _, T = tf_places(estimate, self._model, self._body_id)
        quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat()
        return np.concatenate([T[:, :3, 3], quaternions], axis=1).ravel()
