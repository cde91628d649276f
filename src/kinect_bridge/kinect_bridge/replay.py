"""When each frame of a recording is due: a pure schedule, told the time by its caller.

The frame captured at ``t`` is due, and stamped, at

    stamp = start_at + (t - t_0 + n P) / rate                                              (1)

in the n-th round, where ``t_0`` is the recording's time zero and ``P`` its length over all
sensors and one frame interval. Two processes that replay two sensors of one file with one
``start_at`` thus keep the sensors' timing to the nanosecond, however often they loop.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.errors import InputError
from pose_io.recordings.recording import Recording, StampArray
from pose_io.recordings.timeline import Timeline

NOMINAL_INTERVAL_NS = 33_333_333  # [ns] for a recording of one frame
LONGEST_WAIT_NS = 1_000_000_000
CATCH_UP = 4  # how much faster than due a late replay goes: receivers' queues hold five frames


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """When the frames of one sensor are due."""

    frame: StampArray  # (k,) indices into the stream
    offset_ns: StampArray  # (k,) [ns] t - t_0, strictly increasing
    period_ns: int  # [ns] P
    interval_ns: int  # [ns] between frames, median
    start_at_ns: int  # [ns]
    rate: float  # [-]
    loop: bool

    def due_ns(self, count: int) -> int | None:
        """The stamp of the frame after ``count`` others, or None after the last."""
        rounds, index = divmod(count, len(self.frame))
        if rounds and not self.loop:
            return None
        recorded_ns = int(self.offset_ns[index]) + rounds * self.period_ns
        return self.start_at_ns + round(recorded_ns / self.rate)  # (1)

    def progress(self, count: int) -> float:
        """The share of the recording that ``count`` frames are, in this round, in [0, 1]."""
        if count and count % len(self.frame) == 0:
            return 1.0
        return (count % len(self.frame)) / len(self.frame)


def make_schedule(
    recording: Recording,
    timelines: Sequence[Timeline],
    sensor: str,
    *,
    start_at_ns: int,
    rate: float = 1.0,
    loop: bool = False,
) -> Schedule:
    """Schedule one sensor of a recording.

    Args:
        recording: The recording.
        timelines: The stamps of each of its streams: all of them decide the period.
        sensor: Which stream to replay, see :meth:`Recording.stream`.
        start_at_ns: When the recording's time zero is due [ns].
        rate: How many times faster than recorded.
        loop: Begin anew at the end.

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


@dataclass(frozen=True, kw_only=True)
class DueFrame:
    """A frame to publish now."""

    frame: int  # index into the stream
    stamp_ns: int  # [ns] its capture, on the replay's time


class Replay:
    """How far a schedule has been played."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self.played = 0

    @property
    def finished(self) -> bool:
        """Whether every frame has been played; never when looping."""
        return self.schedule.due_ns(self.played) is None

    @property
    def progress(self) -> float:
        """The share of the recording that has been played in this round, in [0, 1]."""
        return self.schedule.progress(self.played)

    def take(self, now_ns: int) -> DueFrame | None:
        """The next frame, if it is due; one at a time, so that a late replay makes no burst."""
        stamp_ns = self.schedule.due_ns(self.played)
        if stamp_ns is None or stamp_ns > now_ns:
            return None
        frame = int(self.schedule.frame[self.played % len(self.schedule.frame)])
        self.played += 1
        return DueFrame(frame=frame, stamp_ns=stamp_ns)

    def wait_ns(self, now_ns: int) -> int | None:
        """How long to wait before the next :meth:`take` [ns]; None when finished.

        At least a quarter of a frame interval, so that a late replay catches up without a burst;
        at most a second, so that a clock which is set is noticed.
        """
        stamp_ns = self.schedule.due_ns(self.played)
        if stamp_ns is None:
            return None
        shortest_ns = round(self.schedule.interval_ns / self.schedule.rate / CATCH_UP)
        return max(min(stamp_ns - now_ns, LONGEST_WAIT_NS), shortest_ns)
