"""Mapping of a source's skeleton to the 15 joints in a REP 103 optical frame.

A position ``p_source`` in the source's axes and unit becomes
``p_optical = unit_m * R_optical_source @ p_source`` [m], x right, y down, z forward.

Each of the 15 joints is a joint of the source, or the mean of some. Where a source offers a choice,
the shipped maps use the point at the end of a rigid segment, so that bone lengths are constant and
equal across sensors:

- ``hand`` is the wrist and ``foot`` the ankle: a bent wrist or ankle then changes neither the
  length of forearm and shank nor the angle of elbow and knee. The toes, for example, lie 9 cm in
  front of the ankle and would turn the shank by 12 degrees. NiTE2 has no such choice: its forearm
  ends in the palm and is about 7 cm longer.
- ``neck`` is the point between the shoulders where the arms hang, as NiTE2 has it and Kinect v1
  calls ``ShoulderCenter``; the ``Neck`` of Kinect v2 (7 cm) and Azure (4 cm) lies higher and
  moves with the head.
- ``head`` is the middle of the head: for Azure, whose ``HEAD`` is the skull's base, midway between
  the ears.
- ``torso`` is the spine joint nearest to the middle between neck and hips.

The maps are data: :mod:`pose_io.recordings.joint_map_files` reads them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS, TrackingState
from pose_io.arrays import BoolArray, ByteArray, IntArray


@dataclass(frozen=True, kw_only=True)
class ConfidenceLevels:
    """Confidence thresholds of the tracking states, in the source's own scale."""

    inferred: float
    tracked: float


@dataclass(frozen=True, kw_only=True)
class JointMap:
    """Map from one source's skeleton to the 15 joints."""

    sensor: str
    joints: tuple[str, ...]  # the source's names, in the order of its indices
    sources: Mapping[str, tuple[str, ...]]  # source joints averaged, by joint
    R_optical_sdk: FloatArray  # (3, 3) [-], a reflection if the source's axes are left-handed
    unit_m: float  # [m] per unit of the source
    confidence: ConfidenceLevels | None = None  # None: every joint with a position is tracked

    def convert(
        self, positions: FloatArray, tracking_state: ByteArray
    ) -> tuple[FloatArray, ByteArray]:
        """Map a source's joints to the 15, in the optical frame.

        Args:
            positions: In the source's axes and unit, shape (..., n, 3) with the n joints of
                :attr:`joints`; NaN where missing.
            tracking_state: Values of ``TrackingState``, shape (..., n).

        Returns:
            Positions [m], shape (..., 15, 3), and states, shape (..., 15): a mean has the
            worst state of its sources, and is NaN if one of them is missing. A joint that the map
            lacks is NaN and NOT_TRACKED.
        """
        index, weight, is_mapped = self._gathering
        mean = (weight[..., None] * positions[..., index, :]).sum(axis=-2)
        state = tracking_state[..., index].min(axis=-1)
        mean[..., ~is_mapped, :] = np.nan
        state[..., ~is_mapped] = TrackingState.NOT_TRACKED
        return self.unit_m * mean @ self.R_optical_sdk.T, state

    def states(self, confidence: FloatArray | None) -> ByteArray:
        """Tracking states from confidences.

        Args:
            confidence: In the source's scale, any shape; NaN where unknown. None if the source
                has no confidences.

        Returns:
            Values of ``TrackingState``; a joint of unknown confidence counts as tracked.
        """
        if confidence is None:
            return np.full(len(self.joints), TrackingState.TRACKED, dtype=np.uint8)
        state = np.full(np.shape(confidence), TrackingState.TRACKED, dtype=np.uint8)
        if self.confidence is not None:
            state[confidence < self.confidence.tracked] = TrackingState.INFERRED
            state[confidence < self.confidence.inferred] = TrackingState.NOT_TRACKED
        return state

    @cached_property
    def index(self) -> Mapping[str, int]:
        """Index of each of the source's joints by name."""
        return {name: i for i, name in enumerate(self.joints)}

    @cached_property
    def _gathering(self) -> tuple[IntArray, FloatArray, BoolArray]:
        """Indices and weights of the means, both (15, k), and a mask of the mapped joints (15,)."""
        width = max(len(names) for names in self.sources.values())
        index = np.zeros((len(JOINTS), width), dtype=np.int64)
        weight = np.zeros((len(JOINTS), width))
        for row, joint in enumerate(JOINTS):
            names = self.sources.get(joint, ())
            for column in range(width if names else 0):
                index[row, column] = self.index[names[min(column, len(names) - 1)]]
                weight[row, column] = 1.0 / len(names) if column < len(names) else 0.0
        return index, weight, np.array([joint in self.sources for joint in JOINTS])


def mark_missing(positions: FloatArray, tracking_state: ByteArray) -> None:
    """Set, in place, joints without a position or state to NaN and NOT_TRACKED.

    Args:
        positions: Shape (..., 3).
        tracking_state: Shape (...).
    """
    missing = ~np.isfinite(positions).all(axis=-1)
    missing |= tracking_state == TrackingState.NOT_TRACKED
    positions[missing] = np.nan
    tracking_state[missing] = TrackingState.NOT_TRACKED
