"""An estimate's messages as bytes, without making the messages, which takes ten times as long."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import Typestore

from pose_common.joints import JOINT_INDEX
from pose_fusion.body.frames import BodyFrames
from pose_fusion.body.model import ROOT_DOF, BodyModel
from pose_fusion.conversions import (
    STATE_COLORS,
    bone_ends,
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
        self._frames = BodyFrames(model, body_id)
        messages = {
            topic: to_bag_message(message, typestore)
            for topic, message in to_messages(first, model, body_id, 0.0).items()
        }
        self.types = {topic: message.__msgtype__ for topic, message in messages.items()}
        self._topics = list(messages)
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

    def write(self, estimate: BodyEstimate, latency_s: float) -> Iterator[tuple[str, bytes]]:
        """Each topic and its message's bytes, the joint state first."""
        state = estimate.tracking_state
        angles = np.concatenate([estimate.position[ROOT_DOF:], estimate.velocity[ROOT_DOF:]])
        yield self._filled(0, estimate, angles)
        yield self._filled(1, estimate, estimate.joints.ravel(), uint8=state)
        numbers = self._pose_estimate(estimate, latency_s)
        yield self._filled(2, estimate, numbers, uint8=estimate.source)
        points, colors = self._markers(estimate), self._marker_colors(state)
        yield self._filled(3, estimate, points, float32=colors)
        yield self._filled(4, estimate, self._transforms(estimate))

    def _filled(
        self,
        index: int,
        estimate: BodyEstimate,
        float64: FloatArray,
        *,
        float32: NDArray[np.float32] | None = None,
        uint8: NDArray[np.uint8] | None = None,
    ) -> tuple[str, bytes]:
        data = self._templates[index].fill(estimate.stamp_ns, float64, float32, uint8)
        return self._topics[index], data

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
        T_map_link, angles = estimate.T_map_link, estimate.position
        return self._frames.places(T_map_link, angles, estimate.joints).ravel()
