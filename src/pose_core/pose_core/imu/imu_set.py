"""All IMUs of one body: their recent past, their alignment, their reading at an instant."""

import math
from collections.abc import Sequence

import numpy as np

from pose_core.body.joint_angles import joint_angles
from pose_core.body.model import BodyModel
from pose_core.body.trunk import standing_heading, trunk_axes
from pose_core.counters import Counters
from pose_core.imu.alignment import NORTH_STDDEV, ImuAlignment
from pose_core.imu.joints import ImuJoints
from pose_core.imu.readings import NO_READINGS, SegmentReadings
from pose_core.imu.seen_axes import SeenAxes
from pose_core.imu.track import NS_PER_S, ImuStates, ImuTracks
from pose_core.streams.samples import FloatArray, ImuBlock

BEGUN_ANEW_NS = 300_000_000  # a longer gap no orientation filter goes on across


class ImuSet:
    """Knows what every strapped-on IMU says of its segment.

    Args:
        model: The body model: which link a segment is.
        camera_delay_s: How late joints are against their stamps [s].
    """

    def __init__(self, model: BodyModel, camera_delay_s: float = 0.0) -> None:
        self._seen_axes = SeenAxes(model)
        self._camera_delay_ns = round(camera_delay_s * NS_PER_S)
        self._tracks = ImuTracks()
        self._joints = ImuJoints()
        self._states_at: int | None = None  # [ns] the instant of ``_known_states``
        self._known_states: ImuStates | None = None
        self.alignment = ImuAlignment()
        self.counters = Counters(
            "imu_gaps",
            "imu_headings_lost",
            "imu_readings_missing",
            "imu_joint_turns",
            "imu_joint_turns_rejected",
        )

    @property
    def segments(self) -> Sequence[str]:
        """Segments that an IMU has spoken for."""
        return list(self._tracks.segments)

    def add(self, block: ImuBlock) -> int:
        """Keep samples; how many were rejected, for they are no newer than their IMU's last."""
        self._states_at = None
        rejected = self._tracks.add(block)
        for segment, gap_ns in self._tracks.gaps_ns.items():
            self.counters.add("imu_gaps")
            if gap_ns > BEGUN_ANEW_NS and not knows_north(block, segment):
                self.counters.add("imu_headings_lost")
                self.alignment.lose_heading(segment)
                self._joints.forget(segment)
        self._joints.add(block)
        return rejected

    def has_reached(self, stamp_ns: int) -> bool:
        """Whether every IMU that is alive has a sample at or after an instant."""
        return self._tracks.have_reached(stamp_ns)

    def observe(self, stamp_ns: int, positions: FloatArray) -> None:
        """Learn the alignment from what the cameras see.

        Args:
            stamp_ns: The instant.
            positions: Mean of the sensors' tracked joints in map, shape (15, 3) [m]; NaN elsewhere.
        """
        if not self._tracks.segments:
            self.alignment.advance(stamp_ns)
            return
        self._observe(stamp_ns, positions)
        turns = self._joints.until(stamp_ns)
        if turns:
            self.counters.add("imu_joint_turns", len(turns))
            self.counters.add("imu_joint_turns_rejected", self.alignment.relate(turns))

    def _observe(self, stamp_ns: int, positions: FloatArray) -> None:
        # What is seen is older than its stamp; a limb turns by ten degrees in that time.
        states = self._tracks.at(stamp_ns - self._camera_delay_ns)
        trunk = trunk_axes(positions)
        if not states or math.isnan(trunk[0, 0]):  # then all are
            self.alignment.advance(stamp_ns)
            return
        angles, heading = dict[str, float](), np.nan
        if self.alignment.awaits_neutral(states.segments):
            angles = {name: float(a[0]) for name, a in joint_angles(positions[None]).items()}
            heading = standing_heading(positions)
        sights = self._seen_axes.of(states.segments, positions, trunk)
        self.alignment.observe(stamp_ns, states, sights, angles, heading)

    def read(self, stamp_ns: int) -> SegmentReadings:
        """The aligned IMUs' readings at an instant."""
        if not self._tracks.segments:
            return NO_READINGS
        states = self._states(stamp_ns)
        self.counters.add("imu_readings_missing", len(self._tracks.segments) - len(states))
        return self.alignment.readings(states)

    def _states(self, stamp_ns: int) -> ImuStates:
        """Every IMU's interpolated reading; the last instant's are kept, it is asked for twice."""
        if self._known_states is None or self._states_at != stamp_ns:
            self._known_states = self._tracks.at(stamp_ns)
            self._states_at = stamp_ns
        return self._known_states


def knows_north(block: ImuBlock, segment: str) -> bool:
    """Whether an IMU's newest sample in a block has a heading of its own."""
    rows = np.flatnonzero(block.imu == block.segments.index(segment))
    return bool(block.orientation_stddev[rows[-1], 2] < NORTH_STDDEV)
