"""What frames teach beside the pose: measures, trackers' offsets, the IMUs' alignment."""

import numpy as np

from pose_common.counters import Counters
from pose_common.joints import JOINTS, TrackingState
from pose_fusion.body.measuring import BodyMeasuring
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.body.trunk import heading_axes
from pose_fusion.calibration.neutral_stand import NeutralStandWatcher
from pose_fusion.fusion.estimators.kinect_tracker import mean_of_sensors
from pose_fusion.fusion.parameters import FusionParameters
from pose_fusion.fusion.seen import SeenFrame
from pose_fusion.imu.imu_set import ImuSet
from pose_fusion.streams.samples import FloatArray

NS_PER_S = 1_000_000_000
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
        self._latest_ns = [0] * count

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
            self._keep_latest(frame)
            self._imus.observe(frame.stamp_ns, self._seen_now())
        found = self._watch_for_neutral(frame, shape)
        if shape is None and found is None:
            self._counters.add("frames_measuring_the_body")
            found = self._measuring.add(frame.stamp_ns, frame.positions, frame.tracking_state)
        return found

    def _seen_now(self) -> FloatArray:
        """Mean of the sensors' tracked joints, without their trackers' offsets, (15, 3) [m]."""
        mean = mean_of_sensors(self._latest)
        R_map_heading = heading_axes(mean)
        if np.isnan(R_map_heading[0, 0]) or not self.offsets.any():
            return mean
        return mean_of_sensors(self._latest - self.offsets @ R_map_heading.T)

    def _keep_latest(self, frame: SeenFrame) -> None:
        """Remember what each sensor saw last, a short while ago at most."""
        for index, sensor in enumerate(self._parameters.sensors):
            if sensor in frame.sensors:
                is_tracked = frame.tracking_state[index] == TrackingState.TRACKED
                self._latest[index] = np.where(is_tracked[:, None], frame.positions[index], np.nan)
                self._latest_ns[index] = frame.stamp_ns
            elif abs(frame.stamp_ns - self._latest_ns[index]) > LATEST_NS:
                self._latest[index] = np.nan

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
