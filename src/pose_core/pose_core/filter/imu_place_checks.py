"""Whether the IMUs are where they are taken to be: exchanged with another one, or slipped."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.estimates.observation import Observation
from pose_core.filter.frame import CameraFrame
from pose_core.filter.worn_imus import WornImus
from pose_core.imu.exchange_check import ExchangeCheck
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.slip_check import SlipCheck
from pose_core.joints import TrackingState


class ImuPlaceChecks:
    """The checks for exchanged and for slipped IMUs, over the instants added to them.

    Args:
        imus: The IMUs of the body, and where each is worn.
    """

    def __init__(self, imus: WornImus) -> None:
        self._imus = imus
        self.restart_exchanges()
        self.restart_slips()

    def restart_exchanges(self) -> None:
        """Restart the check for exchanged IMUs: its sums are of how they were worn before."""
        self.exchanges = ExchangeCheck()

    def restart_slips(self) -> None:
        """Restart the check for slips, of all IMUs."""
        self.slips = SlipCheck()

    def add_to_exchanges(self, observation: Observation, frames: Sequence[CameraFrame]) -> None:
        """Add one instant to the check for exchanged IMUs, if it is due.

        Args:
            observation: Measurements of all IMUs, and the cameras' frame.
            frames: Its frames in map, with swapped sides exchanged.
        """
        if not self.exchanges.is_due(observation.stamp_ns, observation.imus.slips):
            return
        tracked = _tracked(observation, frames)
        # Where the filter has exchanged sides, either the tracker or the IMUs are wrong.
        as_measured = np.where(tracked == observation.positions, tracked, np.nan)
        moving = self._imus.moving(observation.imus.segments)
        as_moving = _with_segments(observation.imus, moving)
        self.exchanges.add(observation.stamp_ns, as_measured, as_moving)

    def add_to_slips(
        self, observation: Observation, frames: Sequence[CameraFrame], heading: FloatArray
    ) -> None:
        """Add one instant to the check for slips, if it is due.

        Args:
            observation: See :meth:`add_to_exchanges`.
            frames: Likewise.
            heading: Of each link's IMU in the filter's state, (links,) [rad].
        """
        imus, stamp_ns = observation.imus, observation.stamp_ns
        as_worn = _with_segments(imus, self._imus.carriers(imus.segments))
        if not self.slips.is_due(stamp_ns, as_worn.segments, [each.sensor for each in frames]):
            return
        headings = np.full(len(imus), np.nan)  # of the aligned IMUs
        for row, worn in self._imus.with_link(imus.segments):
            if worn.use.is_aligned:
                headings[row] = heading[worn.link]
        self.slips.add(stamp_ns, _tracked(observation, frames), as_worn, headings)


def _tracked(observation: Observation, frames: Sequence[CameraFrame]) -> FloatArray:
    """The tracked joints of an instant's frames in map, (sensors, 15, 3) [m]; NaN otherwise."""
    tracked = np.full(observation.positions.shape, np.nan)
    for frame in frames:
        is_tracked = frame.tracking_state[:, None] == int(TrackingState.TRACKED)
        np.copyto(tracked[frame.sensor], frame.positions, where=is_tracked)
    return tracked


def _with_segments(imus: ImuMeasurements, segments: tuple[str, ...]) -> ImuMeasurements:
    """The measurements, named by other segments."""
    return imus if segments == imus.segments else replace(imus, segments=segments)
