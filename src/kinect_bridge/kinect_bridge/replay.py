"""Schedule of a recording's frames; the time is an argument.

The frame captured at ``t`` is due, and stamped, at

    stamp = start_at + (t - t_0 + n P) / rate                                              (1)

in the n-th round, where ``t_0`` is the recording's time zero and ``P`` its duration over all
sensors plus one frame interval. Two processes that replay two sensors of one file with the same
``start_at`` thus preserve the sensors' relative timing to the nanosecond, also in later rounds.
"""

from collections.abc import Sequence

import numpy as np

from pose_core.errors import InputError
from pose_io.recordings.recording import Recording
from pose_io.recordings.timeline import StreamTimeline

NOMINAL_INTERVAL_NS = 33_333_333  # [ns] for a recording of one frame
MAX_WAIT_NS = 1_000_000_000
CATCH_UP = 4  # [-] largest speed-up of a late replay: receivers' queues hold five frames


class Replay:
    """One sensor's frames with their due times, and how many have been played.

    Args:
        recording: The recording.
        timelines: The stamps of each of its streams, which determine the period.
        sensor: The stream to replay, see :meth:`Recording.stream`.
        start_at_ns: Host time of the recording's time zero [ns].
        rate: Speed relative to the recording.
        loop: Whether to restart at the end.

    Attributes:
        stream: The stream.
        timeline: Its stamps.
        played: How many frames have been played or skipped.

    Raises:
        InputError: If there is no such sensor, or it has no frames.
    """

    def __init__(
        self,
        recording: Recording,
        timelines: Sequence[StreamTimeline],
        sensor: str,
        *,
        start_at_ns: int,
        rate: float = 1.0,
        loop: bool = False,
    ) -> None:
        self.stream = recording.stream(sensor)
        self.timeline = timelines[recording.streams.index(self.stream)]
        if not len(self.timeline):
            raise InputError(
                f"{recording.source}: sensor '{self.stream.name}' has no frames to replay"
            )
        intervals = np.concatenate([np.diff(other.time_ns) for other in timelines])
        begin = min(int(other.time_ns[0]) for other in timelines if len(other))
        end = max(int(other.time_ns[-1]) for other in timelines if len(other))
        self._frame = self.timeline.frame  # (k,) indices into the stream
        self._offset_ns = self.timeline.time_ns - recording.time_zero_ns  # (k,) t - t_0
        self._interval_ns = int(np.median(intervals)) if len(intervals) else NOMINAL_INTERVAL_NS
        self._period_ns = end - begin + self._interval_ns  # P
        self._rate, self._loop = rate, loop
        self.restart(start_at_ns)

    def restart(self, start_at_ns: int) -> None:
        """Begin again, with the recording's time zero at this host time [ns]."""
        self._start_at_ns, self.played = start_at_ns, 0

    def due_ns(self, count: int) -> int | None:
        """The stamp [ns] of the frame after ``count`` others, or None after the last."""
        rounds, index = divmod(count, len(self._frame))
        if rounds and not self._loop:
            return None
        recorded_ns = int(self._offset_ns[index]) + rounds * self._period_ns
        return self._start_at_ns + round(recorded_ns / self._rate)  # (1)

    @property
    def finished(self) -> bool:
        """Whether all frames have been played; never when looping."""
        return self.due_ns(self.played) is None

    @property
    def progress(self) -> float:
        """Fraction of this round that has been played, 0 to 1."""
        rounds, index = divmod(self.played, len(self._frame))
        return 1.0 if rounds and not index else index / len(self._frame)

    def take(self, now_ns: int) -> tuple[int, int] | None:
        """The next frame, if it is due; one per call, so that a late replay causes no burst.

        Returns:
            Its index in the stream, and its stamp on the replay's time [ns].
        """
        stamp_ns = self.due_ns(self.played)
        if stamp_ns is None or stamp_ns > now_ns:
            return None
        frame = int(self._frame[self.played % len(self._frame)])
        self.played += 1
        return frame, stamp_ns

    def skip(self, before_ns: int) -> int:
        """Skip the frames that were due before an instant [ns]; returns their number."""
        begin = self.played
        if self._loop:
            missed_ns = (before_ns - self._start_at_ns) * self._rate
            rounds = max(0, int(missed_ns // self._period_ns) - 1)
            self.played += rounds * len(self._frame)
        while (due_ns := self.due_ns(self.played)) is not None and due_ns < before_ns:
            self.played += 1
        return self.played - begin

    def wait_ns(self, now_ns: int) -> int | None:
        """Time until the next call of :meth:`take` [ns]; None when finished.

        At least a quarter of a frame interval, so that a late replay catches up without a burst;
        at most a second, so that a step of the clock is detected.
        """
        stamp_ns = self.due_ns(self.played)
        if stamp_ns is None:
            return None
        shortest_ns = round(self._interval_ns / self._rate / CATCH_UP)
        return max(min(stamp_ns - now_ns, MAX_WAIT_NS), shortest_ns)
