"""Schedule of a recording's frames; the time is an argument.

The frame captured at ``t`` is due, and stamped, at

    stamp = start_at + (t - t_0 + n P) / rate                                              (1)

in the n-th round, where ``t_0`` is the recording's time zero and ``P`` its duration over all
sensors plus one frame interval. Two processes that replay two sensors of one file with the same
``start_at`` thus preserve the sensors' relative timing to the nanosecond, also in later rounds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.errors import InputError
from pose_io.recordings.recording import Recording, StampArray
from pose_io.recordings.timeline import StreamTimeline

NOMINAL_INTERVAL_NS = 33_333_333  # [ns] for a recording of one frame
LONGEST_WAIT_NS = 1_000_000_000
CATCH_UP = 4  # [-] largest speed-up of a late replay: receivers' queues hold five frames


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """Due times of one sensor's frames."""

    frame: StampArray  # (k,) indices into the stream
    offset_ns: StampArray  # (k,) [ns] t - t_0, strictly increasing
    period_ns: int  # [ns] P
    interval_ns: int  # [ns] between frames, median
    start_at_ns: int  # [ns]
    rate: float  # [-]
    loop: bool

    def due_ns(self, count: int) -> int | None:
        """The stamp [ns] of the frame after ``count`` others, or None after the last."""
        rounds, index = divmod(count, len(self.frame))
        if rounds and not self.loop:
            return None
        recorded_ns = int(self.offset_ns[index]) + rounds * self.period_ns
        return self.start_at_ns + round(recorded_ns / self.rate)  # (1)


def make_schedule(
    recording: Recording,
    timelines: Sequence[StreamTimeline],
    sensor: str,
    *,
    start_at_ns: int,
    rate: float = 1.0,
    loop: bool = False,
) -> Schedule:
    """Schedule one sensor of a recording.

    Args:
        recording: The recording.
        timelines: The stamps of each of its streams, which determine the period.
        sensor: The stream to replay, see :meth:`Recording.stream`.
        start_at_ns: Host time of the recording's time zero [ns].
        rate: Speed relative to the recording.
        loop: Whether to restart at the end.

    Raises:
        InputError: If there is no such sensor, or it has no frames.
    """
    stream = recording.stream(sensor)
    timeline = timelines[recording.streams.index(stream)]
    if not len(timeline):
        raise InputError(f"{recording.source}: sensor '{stream.name}' has no frames to replay")
    intervals = np.concatenate([np.diff(other.time_ns) for other in timelines])
    interval_ns = int(np.median(intervals)) if len(intervals) else NOMINAL_INTERVAL_NS
    begin = min(int(other.time_ns[0]) for other in timelines if len(other))
    end = max(int(other.time_ns[-1]) for other in timelines if len(other))
    return Schedule(
        frame=timeline.frame,
        offset_ns=timeline.time_ns - recording.time_zero_ns,
        period_ns=end - begin + interval_ns,
        interval_ns=interval_ns,
        start_at_ns=start_at_ns,
        rate=rate,
        loop=loop,
    )


class Replay:
    """Progress of a schedule."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self.played = 0

    @property
    def finished(self) -> bool:
        """Whether all frames have been played; never when looping."""
        return self.schedule.due_ns(self.played) is None

    @property
    def progress(self) -> float:
        """Fraction of this round that has been played, 0 to 1."""
        rounds, index = divmod(self.played, len(self.schedule.frame))
        return 1.0 if rounds and not index else index / len(self.schedule.frame)

    def take(self, now_ns: int) -> tuple[int, int] | None:
        """The next frame, if it is due; one per call, so that a late replay causes no burst.

        Returns:
            Its index in the stream, and its stamp on the replay's time [ns].
        """
        stamp_ns = self.schedule.due_ns(self.played)
        if stamp_ns is None or stamp_ns > now_ns:
            return None
        frame = int(self.schedule.frame[self.played % len(self.schedule.frame)])
        self.played += 1
        return frame, stamp_ns

    def skip(self, before_ns: int) -> int:
        """Skip the frames that were due before an instant [ns]; returns their number."""
        begin, schedule = self.played, self.schedule
        if schedule.loop:
            missed_ns = (before_ns - schedule.start_at_ns) * schedule.rate
            rounds = max(0, int(missed_ns // schedule.period_ns) - 1)
            self.played += rounds * len(schedule.frame)
        while (due_ns := self.schedule.due_ns(self.played)) is not None and due_ns < before_ns:
            self.played += 1
        return self.played - begin

    def wait_ns(self, now_ns: int) -> int | None:
        """Time until the next call of :meth:`take` [ns]; None when finished.

        At least a quarter of a frame interval, so that a late replay catches up without a burst;
        at most a second, so that a step of the clock is detected.
        """
        stamp_ns = self.schedule.due_ns(self.played)
        if stamp_ns is None:
            return None
        shortest_ns = round(self.schedule.interval_ns / self.schedule.rate / CATCH_UP)
        return max(min(stamp_ns - now_ns, LONGEST_WAIT_NS), shortest_ns)
