"""What frames teach beside the pose: measures, trackers' offsets, the IMUs' alignment."""

import numpy as np

from pose_core.body.measuring import BodyMeasuring
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.body.trunk import HIPS_AND_NECK
from pose_core.counters import Counters
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.seen import SeenFrame
from pose_core.imu.imu_set import ImuSet
from pose_core.joints import JOINTS
from pose_core.kernels.compiling import settled
from pose_core.kernels.seeing import keep_latest, mean_without_offsets
from pose_core.session.neutral_stand import NeutralStandWatcher
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import FloatArray

LATEST_NS = NS_PER_S // 20  # sensors that are this far apart still show the same pose
COUNTERS = ("frames_measuring_the_body", "neutral_stands")


class FrameLearner:
    """Learns from one frame after the other.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
        imus: Whose alignment is learnt.
        counters: Declares :data:`COUNTERS`.
        takes_offsets: Whether anybody wants the trackers' offsets.
    """

    def __init__(
        self,
        model: BodyModel,
        parameters: FusionParameters,
        imus: ImuSet,
        counters: Counters,
        *,
        takes_offsets: bool,
    ) -> None:
        count = len(parameters.sensors)
        self.offsets = np.zeros((count, len(JOINTS), 3))
        """(sensors, 15, 3) [m] of each tracker's joints, in heading axes."""
        self._parameters = parameters
        self._imus = imus
        self._counters = counters
        self._neutral_watcher = NeutralStandWatcher(model) if takes_offsets else None
        self._measuring = BodyMeasuring(model, parameters.shape_duration)
        self._latest = np.full((count, len(JOINTS), 3), np.nan)
        self._latest_ns = np.zeros(count, np.int64)
        self._keep_latest, self._mean = settled(keep_latest), settled(mean_without_offsets)

    @property
    def status(self) -> str:
        """How the measuring of the body goes, for people."""
        return self._measuring.status

    def learn(self, frame: SeenFrame, shape: BodyShape | None) -> BodyShape | None:
        """Take a frame.

        Args:
            frame: What the sensors saw.
            shape: The person's measures, as far as they are known.

        Returns:
            The person's measures, if they have just been found.
        """
        if self._parameters.use_imus:
            self._keep_latest(
                frame.stamp_ns,
                frame.is_present,
                frame.positions,
                frame.tracking_state,
                LATEST_NS,
                self._latest,
                self._latest_ns,
            )
            self._imus.observe(frame.stamp_ns, self._seen_now())
        found = self._watch_for_neutral(frame, shape)
        if shape is None and found is None:
            self._counters.add("frames_measuring_the_body")
            found = self._measuring.add(frame.stamp_ns, frame.positions, frame.tracking_state)
        return found

    def _seen_now(self) -> FloatArray:
        """Mean of the sensors' tracked joints, without their trackers' offsets, (15, 3) [m]."""
        mean = np.empty(self._latest.shape[1:])
        self._mean(self._latest, self.offsets, HIPS_AND_NECK, mean)
        return mean

    def _watch_for_neutral(self, frame: SeenFrame, shape: BodyShape | None) -> BodyShape | None:
        """Take the trackers' offsets, and measures if there are none, from a neutral stand."""
        if self._neutral_watcher is None:
            return None
        watcher = self._neutral_watcher
        stand = watcher.add(frame.stamp_ns, frame.positions, frame.tracking_state, shape)
        if stand is None:
            return None
        self._neutral_watcher = None
        self.offsets = stand.offsets
        self._counters.add("neutral_stands")
        return stand.shape if shape is None else None
