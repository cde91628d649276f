"""Serialised messages of estimates, written directly: creating the messages is ten times slower."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import Typestore

from pose_core.api import ROOT_DOF, BodyEstimate, BodyFrames, BodyModel, EstimateBlock, FloatArray
from pose_core.joints import JOINT_INDEX
from pose_fusion.conversions import STATE_COLORS, bone_ends, to_bag_message, to_messages
from pose_io.cdr.message_template import MessageTemplate


class EstimateBytes:
    """The bytes of :func:`pose_fusion.conversions.to_messages`, for one person and model.

    Args:
        model: The body model of all estimates.
        body_id: The person's id.
        typestore: Definitions of the messages.
        first: Any estimate; its messages are the template of all.
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
        *_, markers, _ = self._templates
        self._fix_appearance(markers, len(first.joints))

    def _fix_appearance(self, markers: MessageTemplate, joints: int) -> None:
        """Of the markers, bones and balls, only points and the balls' colours change."""
        points, colors = 3 * len(self._bones), 4 * joints
        # Each marker's own pose and scale come before its points, both's own colours before all.
        own = (len(markers.float64) - points - 3 * joints) // 2
        is_point = np.ones(len(markers.float64), bool)
        is_point[:own] = is_point[own + points :][:own] = False
        is_color = np.arange(len(markers.float32)) >= len(markers.float32) - colors
        markers.change_only(is_point, is_color)

    def write(
        self, estimates: EstimateBlock, latencies_s: FloatArray
    ) -> Iterator[tuple[str, NDArray[np.uint8]]]:
        """Each topic and the bytes of its messages, shape (n, bytes), the joint states first.

        Args:
            estimates: Estimates at n instants.
            latencies_s: Latency of each [s], shape (n,).
        """
        return zip(self._topics, self._rows(estimates, latencies_s), strict=True)

    def _rows(
        self, estimates: EstimateBlock, latencies_s: FloatArray
    ) -> Iterator[NDArray[np.uint8]]:
        """The bytes by topic; the first are published before the next are written."""
        joint_states, skeleton, estimate, markers, tf = self._templates
        stamps_ns, position, velocity = estimates.stamps_ns, estimates.position, estimates.velocity
        angles = np.concatenate([position[:, ROOT_DOF:], velocity[:, ROOT_DOF:]], axis=1)
        yield joint_states.fill(stamps_ns, angles)
        joints, state = estimates.joints, estimates.tracking_state
        points = joints.reshape(len(estimates), -1)
        yield skeleton.fill(stamps_ns, points, uint8=state)
        numbers = (
            np.where(estimates.is_known, position, np.nan),
            velocity,
            estimates.position_stddev,
            estimates.weight_kinect,
            estimates.weight_imu,
            latencies_s[:, None],
        )
        yield estimate.fill(stamps_ns, np.concatenate(numbers, axis=1), uint8=estimates.source)
        bones = joints[:, self._bones].reshape(len(joints), -1)
        colors = self._colors[state].reshape(len(state), -1)
        places = np.concatenate([bones, points], axis=1)
        yield markers.fill(stamps_ns, places, float32=colors)
        frames = self._frames.places(estimates.T_map_link, position, estimates.fk_joints)
        yield tf.fill(stamps_ns, frames.reshape(len(estimates), -1))
