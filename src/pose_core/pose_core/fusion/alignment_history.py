"""Sensor-to-segment alignments as they were at a recording's beginning, from the samples after it.

The last estimate is the best one, unless the IMU has slipped. So each estimate is compared with the
one ten seconds after the IMU's first. If they differ clearly, the IMU has slipped within the ten
seconds before: within that time, a slip shows. What was estimated before them holds at the
beginning, the last estimate after them, and in between the IMU is not to be used. A difference
within the next ten seconds is no slip, unless the IMU has been aligned anew and its estimates had
settled before, five seconds after the first: otherwise these were wrong. A minute after the last
IMU was aligned, its estimate hardly improves any more.
"""

from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from pose_core.fusion.pipeline import Pipeline
from pose_core.imu.sensor_to_segment import SensorsToSegments, SensorToSegment, Slip
from pose_core.kernels.rotations import logarithm
from pose_core.stamps import NS_PER_S

PERIOD_NS = NS_PER_S  # [ns] between two estimates that are compared
SHOWS_NS = 10 * NS_PER_S  # [ns] within which a slip shows, and after which estimates are compared
SETTLED_NS = 5 * NS_PER_S  # [ns] after an IMU's first estimate, which may be wrong
DROPPED_NS = 3 * PERIOD_NS // 2  # [ns] without an estimate: it has been aligned anew
COMPLETE_NS = 60 * NS_PER_S  # [ns] since the last IMU was aligned
STDDEV = np.radians([3.3, 3.3, 6.0])
"""[rad] of an estimate about the segment's axes, in addition to its own; turns settle slowly."""
MAX_SIGMAS = 3.5  # [-] by which estimates of the same sensor-to-segment rotation differ


@dataclass(kw_only=True)
class _Estimates:
    first_ns: int
    worn_as: tuple[str, bool]  # exchanged_with and z_down, see SensorToSegment
    reference: tuple[int, SensorToSegment] | None = None
    recent: deque[tuple[int, SensorToSegment]] = field(default_factory=deque)
    slip_shown_ns: int | None = None


class AlignmentHistory:
    """Follows a pipeline over a recording, and selects the estimates that hold at its beginning."""

    def __init__(self) -> None:
        self._estimates: dict[str, _Estimates] = {}
        self._last_ns: int | None = None

    def note(self, pipeline: Pipeline) -> None:
        """Note the present estimates, once a second."""
        stamp_ns = pipeline.newest_ns
        if self._last_ns is not None and 0 <= stamp_ns - self._last_ns < PERIOD_NS:
            return
        self._last_ns = stamp_ns
        for segment, alignment in pipeline.sensor_to_segment.items():
            own = self._estimates.get(segment)
            worn_as = alignment.exchanged_with, alignment.z_down
            as_now = _Estimates(first_ns=stamp_ns, worn_as=worn_as)
            if own is None or own.worn_as != worn_as:
                own = self._estimates[segment] = as_now
            if own.slip_shown_ns is not None:
                continue
            if own.reference is None:
                if stamp_ns - own.first_ns >= SHOWS_NS:
                    own.reference = stamp_ns, alignment
            elif _differ(own.reference[1], alignment):
                was_dropped = stamp_ns - own.recent[-1][0] > DROPPED_NS
                least_ns = own.first_ns + SETTLED_NS if was_dropped else own.reference[0]
                if own.recent[0][0] >= least_ns:
                    own.slip_shown_ns = stamp_ns
                    continue
                own = self._estimates[segment] = as_now
            own.recent.append((stamp_ns, alignment))
            while len(own.recent) > 1 and own.recent[1][0] <= stamp_ns - SHOWS_NS:
                own.recent.popleft()

    @property
    def is_complete(self) -> bool:
        """Whether later estimates would hardly change those at the beginning."""
        if self._last_ns is None or not self._estimates:
            return False
        newest_ns = max(each.first_ns for each in self._estimates.values())
        return self._last_ns - newest_ns >= COMPLETE_NS

    def initial(self, pipeline: Pipeline) -> SensorsToSegments:
        """The alignments at the beginning: of the IMUs that are aligned at the recording's end.

        And of those that are not, but had been aligned for ten seconds.
        """
        aligned = pipeline.sensor_to_segment
        lost = {
            segment: own.recent[0][1]
            for segment, own in self._estimates.items()
            if own.reference is not None and segment not in aligned
        }
        return {
            **lost,
            **{segment: self._initial(segment, final) for segment, final in aligned.items()},
        }

    def _initial(self, segment: str, final: SensorToSegment) -> SensorToSegment:
        own = self._estimates.get(segment)
        if own is None or own.slip_shown_ns is None:
            return final
        begin_ns = own.recent[-1][0] - SHOWS_NS
        return replace(
            own.recent[0][1], slip=Slip(begin_ns=begin_ns, end_ns=own.slip_shown_ns, after=final)
        )


def _differ(reference: SensorToSegment, alignment: SensorToSegment) -> bool:
    turned = np.empty(3)
    logarithm(reference.R_sensor_segment.T @ alignment.R_sensor_segment, turned)
    variance = reference.stddev**2 + STDDEV**2
    return bool(np.sum(turned**2 / variance) > MAX_SIGMAS**2)
