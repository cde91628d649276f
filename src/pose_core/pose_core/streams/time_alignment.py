r"""Time alignment of several skeleton streams by linear interpolation.

The k-th frames of the sensors are compared; :math:`t_1` is the smaller stamp, :math:`t_2` the
larger, :math:`t_{prev}` the stamp before it of the same sensor (li2020 (2)):

.. math:: p(t_1) = p(t_{prev}) + \frac{t_1 - t_{prev}}{t_2 - t_{prev}} (p(t_2) - p(t_{prev}))

Generalised to any number of sensors, and to frames that are late, missing or repeated.
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter

import numpy as np

from pose_core.counters import Counters
from pose_core.errors import ParameterError
from pose_core.finite_numbers import are_known
from pose_core.joints import TrackingState
from pose_core.stamps import JUMP_BACK_NS, NS_PER_S
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.series import SLOWEST_S, longest_gap_s

BEFORE_ALL_NS = -(2**63)
PERIODS = 9  # [-] intervals whose median is a sensor's period
COUNTS = (
    "received",
    "repeated_stamp",
    "backward_stamp",
    "clock_jumped_back",
    "returned",
    "late",
    "frames",
    "incomplete_frames",
)


@dataclass(frozen=True, kw_only=True)
class AlignedFrame:
    """Samples of the sensors, interpolated to one instant."""

    stamp_ns: int  # [ns] of the earliest of the paired frames
    samples: Mapping[str, SkeletonSample]  # by sensor, all at stamp_ns; without absent sensors


@dataclass
class _Stream:
    """One sensor's samples that may still be needed."""

    samples: list[SkeletonSample] = field(default_factory=list)  # ascending stamps
    gaps_ns: list[int] = field(default_factory=list)  # [ns] longest gap allowed before each
    intervals_ns: deque[int] = field(default_factory=lambda: deque(maxlen=PERIODS))
    next_index: int = 0  # index of the first sample that may still open a frame
    first_ns: int | None = None
    last_ns: int | None = None
    away: list[tuple[int, int]] = field(default_factory=list)  # (from, to]: it is absent
    silent: bool = False  # not waited for until it sends again

    @property
    def head_ns(self) -> int | None:
        """The stamp of the next sample that may open a frame."""
        waiting = self.next_index < len(self.samples)
        return self.samples[self.next_index].stamp_ns if waiting else None

    @property
    def period_ns(self) -> int:
        """Usual interval between its samples [ns]; 0 while it is not known."""
        if len(self.intervals_ns) <= PERIODS // 2:
            return 0
        return sorted(self.intervals_ns)[len(self.intervals_ns) // 2]

    def joined(self, stamp_ns: int) -> bool:
        """Whether the sensor takes part in a frame."""
        return not (self.away and any(begin < stamp_ns <= end for begin, end in self.away))

    def forget_before(self, stamp_ns: int) -> None:
        """Discard samples before a stamp, except the last one and unused ones."""
        later = bisect_left(self.samples, stamp_ns + 1, key=attrgetter("stamp_ns"))
        count = max(0, min(later - 1, self.next_index))
        del self.samples[:count], self.gaps_ns[:count]
        self.next_index -= count
        self.away = [(from_ns, to_ns) for from_ns, to_ns in self.away if to_ns > stamp_ns]


class TimeAligner:
    """Interpolates the samples of several sensors to common instants.

    A frame opens at the earliest sample that no frame has used yet. Samples of the other sensors
    up to ``max_skew_s`` later are its pairs and open no frame of their own, so a dropped frame
    disturbs one pairing, not all that follow. Every sensor is interpolated to the frame's stamp
    between the two samples around it; where these lie more than ``max_gap_s`` apart, it is absent.
    For a sensor whose frames are slower than that, the limits are 1.5 of its periods, up to 0.45 s.

    A frame waits for every sensor. One that stays away for more than ``max_wait_s``, by the stamps
    of the others, is waited for no longer until it sends again. The first sample after such a
    silence only begins the interpolation: the sensor is back from ``max_skew_s`` after it.

    The frames depend on each sensor's own sequence of samples, not on how the sequences interleave,
    as long as no sample arrives more than ``max_skew_s`` (of stamps) behind the other sensors'.
    A sensor that was silent to the aligner because it came later than ``max_wait_s`` has missed the
    frames already emitted (counted as ``late``).

    Stamps of the frames strictly increase, except that a sensor whose stamps jump back by more than
    1 s (a recording that loops) restarts the alignment.

    Args:
        sensors: Their names; with a single one, samples pass without delay.
        max_skew_s: Largest difference [s] of stamps in a pair: half a frame period and some room
            for jitter (20 ms is half a period at 25 Hz, 0.6 at 30 Hz).
        max_gap_s: Longest gap [s] to interpolate across.
        max_wait_s: Longest silence [s] to wait for.

    Raises:
        ParameterError: If the limits contradict each other, or no sensor is named.

    References:
        li2020 (2).
    """

    def __init__(
        self,
        sensors: Sequence[str],
        *,
        max_skew_s: float = 0.02,
        max_gap_s: float = 0.1,
        max_wait_s: float = 0.2,
    ) -> None:
        if not sensors or len(set(sensors)) != len(sensors):
            raise ParameterError(f"sensors = {list(sensors)}: expected one or more different names")
        if not 0.0 < max_skew_s <= max_gap_s <= max_wait_s - max_skew_s:
            raise ParameterError(
                f"max_skew = {max_skew_s} s, max_gap = {max_gap_s} s, max_wait = {max_wait_s} s: "
                "expected 0 < max_skew <= max_gap <= max_wait - max_skew"
            )
        self._max_skew_ns = round(max_skew_s * NS_PER_S)
        self._max_gap_ns = round(max_gap_s * NS_PER_S)
        self._max_wait_ns = round(max_wait_s * NS_PER_S)
        self._streams = {name: _Stream() for name in sensors}
        self._last_emitted_ns: int | None = None
        self.counters = Counters(*COUNTS)

    def add(self, sample: SkeletonSample) -> list[AlignedFrame]:
        """Add one sample and return the frames that it completes.

        Raises:
            ValueError: If the sample is of a sensor that was not named.
        """
        if sample.sensor not in self._streams:
            raise ValueError(f"sensor '{sample.sensor}' is not one of {list(self._streams)}")
        self.counters.add("received")
        stream = self._streams[sample.sensor]
        frames: list[AlignedFrame] = []
        if stream.last_ns is not None and sample.stamp_ns <= stream.last_ns:
            if stream.last_ns - sample.stamp_ns <= JUMP_BACK_NS:
                repeated = sample.stamp_ns == stream.last_ns
                self.counters.add("repeated_stamp" if repeated else "backward_stamp")
                return []
            self.counters.add("clock_jumped_back")
            frames = self.flush()
            self.reset()
            stream = self._streams[sample.sensor]
        self._append(stream, sample)
        return frames + self._emit(waiting=True)

    def has_heard(self, sensor: str) -> bool:
        """Whether a sensor has sent anything since the start."""
        return self._streams[sensor].last_ns is not None

    def flush(self) -> list[AlignedFrame]:
        """Return the remaining frames, after the end of the streams."""
        return self._emit(waiting=False)

    def reset(self) -> None:
        """Discard all samples; counts stay."""
        self._streams = {name: _Stream() for name in self._streams}
        self._last_emitted_ns = None

    def _append(self, stream: _Stream, sample: SkeletonSample) -> None:
        if self._is_return(stream, sample.stamp_ns):
            self.counters.add("returned")
            gone_ns = stream.last_ns if stream.last_ns is not None else BEFORE_ALL_NS
            stream.away.append((gone_ns, sample.stamp_ns + self._max_skew_ns))
        if self._last_emitted_ns is not None and sample.stamp_ns <= self._last_emitted_ns:
            self.counters.add("late")
        if stream.last_ns is not None and sample.stamp_ns - stream.last_ns < SLOWEST_S * NS_PER_S:
            stream.intervals_ns.append(sample.stamp_ns - stream.last_ns)
        stream.samples.append(sample)
        stream.gaps_ns.append(self._longest_gap_ns(stream))
        if stream.first_ns is None:
            stream.first_ns = sample.stamp_ns
        stream.last_ns = sample.stamp_ns
        stream.silent = False
        waiting = [s.head_ns for s in self._streams.values() if s.head_ns is not None]
        for each in self._streams.values():
            each.forget_before(min(waiting) - 1)

    def _is_return(self, stream: _Stream, stamp_ns: int) -> bool:
        """Whether a sample follows a silence.

        Judged by stamps alone, a little earlier than a silence is noticed, so that it makes no
        difference whether the others' samples arrived just before or just after it.
        """
        others = [other.first_ns for other in self._streams.values() if other is not stream]
        begun = [first_ns for first_ns in others if first_ns is not None]
        if not others:
            return False
        since_ns = stream.last_ns if stream.last_ns is not None else min(begun, default=stamp_ns)
        longest_ns = self._longest_wait_ns(stream) - self._max_skew_ns
        return stream.silent or stamp_ns - since_ns > longest_ns

    def _longest_gap_ns(self, stream: _Stream) -> int:
        """Longest gap [ns] to interpolate across."""
        at_least_s = self._max_gap_ns / NS_PER_S
        return round(longest_gap_s(stream.period_ns / NS_PER_S, at_least_s) * NS_PER_S)

    def _longest_wait_ns(self, stream: _Stream) -> int:
        """Longest silence [ns] to wait for."""
        return self._max_wait_ns + self._longest_gap_ns(stream) - self._max_gap_ns

    def _emit(self, *, waiting: bool) -> list[AlignedFrame]:
        frames = []
        while (stamp_ns := self._next_stamp()) is not None:
            if waiting and self._must_wait(stamp_ns):
                break
            frames.append(self._frame(stamp_ns))
            self._last_emitted_ns = stamp_ns
            for stream in self._streams.values():
                self._consume(stream, stamp_ns)
        return frames

    def _next_stamp(self) -> int | None:
        """The earliest sample that opens a frame."""
        for stream in self._streams.values():
            while (head_ns := stream.head_ns) is not None and not self._opens(stream, head_ns):
                stream.next_index += 1
        heads = [stream.head_ns for stream in self._streams.values()]
        return min((head_ns for head_ns in heads if head_ns is not None), default=None)

    def _opens(self, stream: _Stream, stamp_ns: int) -> bool:
        emitted = self._last_emitted_ns is not None and stamp_ns <= self._last_emitted_ns
        return stream.joined(stamp_ns) and not emitted

    def _must_wait(self, stamp_ns: int) -> bool:
        newest_ns = max(s.last_ns for s in self._streams.values() if s.last_ns is not None)
        must_wait = False
        for stream in self._streams.values():
            reached = stream.last_ns is not None and stream.last_ns >= stamp_ns
            if reached or stream.silent or not stream.joined(stamp_ns):
                continue
            stream.silent = newest_ns - stamp_ns > self._longest_wait_ns(stream)
            must_wait |= not stream.silent
        return must_wait

    def _frame(self, stamp_ns: int) -> AlignedFrame:
        at_stamp = {name: self._at(stream, stamp_ns) for name, stream in self._streams.items()}
        samples = {name: sample for name, sample in at_stamp.items() if sample is not None}
        self.counters.add("frames")
        self.counters.add("incomplete_frames", int(len(samples) < len(self._streams)))
        return AlignedFrame(stamp_ns=stamp_ns, samples=samples)

    def _at(self, stream: _Stream, stamp_ns: int) -> SkeletonSample | None:
        if not stream.joined(stamp_ns):
            return None
        index = bisect_left(stream.samples, stamp_ns, key=attrgetter("stamp_ns"))
        if index == len(stream.samples):
            return None
        after = stream.samples[index]
        if after.stamp_ns == stamp_ns:
            return after
        before = stream.samples[index - 1] if index > 0 else None
        if before is None or after.stamp_ns - before.stamp_ns > stream.gaps_ns[index]:
            return None
        return interpolate(before, after, stamp_ns)

    def _consume(self, stream: _Stream, stamp_ns: int) -> None:
        """Mark a frame's samples as used, so that they open no other frame."""
        head_ns = stream.head_ns
        paired = head_ns is not None and head_ns <= stamp_ns + self._max_skew_ns
        if paired and stream.joined(stamp_ns):
            stream.next_index += 1
        stream.forget_before(stamp_ns)


def interpolate(before: SkeletonSample, after: SkeletonSample, stamp_ns: int) -> SkeletonSample:
    """Interpolate between two samples of the same sensor, joint by joint.

    A joint needs both ends; its tracking state is the worse of the two.

    Args:
        before: The sample before the instant (``t_prev``).
        after: The sample after it (``t_2``).
        stamp_ns: The instant [ns] (``t_1``).

    References:
        li2020 (2).
    """
    share = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)  # [-] 0..1
    positions = before.positions + share * (after.positions - before.positions)  # li2020 (2)
    state = np.minimum(before.tracking_state, after.tracking_state)
    known = are_known(positions) & (state != int(TrackingState.NOT_TRACKED))
    return replace(
        after,
        stamp_ns=stamp_ns,
        positions=np.where(known[:, None], positions, np.nan),
        tracking_state=np.where(known, state, np.uint8(TrackingState.NOT_TRACKED)),
    )
