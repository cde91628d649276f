"""All IMUs of one body: their recent past, their readings at an instant."""

from collections.abc import Sequence

from pose_core.counters import Counters
from pose_core.imu.track import NO_STATES, ImuStates, ImuTracks
from pose_core.streams.samples import ImuBlock


class ImuSet:
    """Knows what every strapped-on IMU says, each in its own world."""

    def __init__(self) -> None:
        self._tracks = ImuTracks()
        self._states_at: int | None = None  # [ns] the instant of ``_known_states``
        self._known_states = NO_STATES
        self.counters = Counters("imu_gaps", "imu_readings_missing")

    @property
    def segments(self) -> Sequence[str]:
        """Segments that an IMU has spoken for."""
        return list(self._tracks.segments)

    def add(self, block: ImuBlock) -> int:
        """Keep samples; how many were rejected, for they are no newer than their IMU's last."""
        self._states_at = None
        rejected = self._tracks.add(block)
        self.counters.add("imu_gaps", len(self._tracks.gaps_ns))
        return rejected

    def has_reached(self, stamp_ns: int) -> bool:
        """Whether every IMU that is alive has a sample at or after an instant."""
        return self._tracks.have_reached(stamp_ns)

    def read(self, stamp_ns: int) -> ImuStates:
        """The IMUs' readings at an instant; the last instant's are kept, it is asked for twice."""
        if not self._tracks.segments:
            return NO_STATES
        if self._states_at != stamp_ns:
            self._known_states = self._tracks.at(stamp_ns)
            self._states_at = stamp_ns
        missing = len(self._tracks.segments) - len(self._known_states)
        self.counters.add("imu_readings_missing", missing)
        return self._known_states
