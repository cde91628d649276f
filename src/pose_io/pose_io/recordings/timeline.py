"""The stamps of a stream's frames, strictly increasing, on the host's clock.

Repeated frames and frames with decreasing stamps are left out and counted; where the sensor's own
clock is known, or the file has no order of arrival, frames out of order are sorted.
"""

from bisect import bisect_left
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.counters import Counters
from pose_io.arrays import BoolArray, IntArray
from pose_io.recordings.clock_fit import ClockFit, fit_clock
from pose_io.recordings.recording import SensorStream

SENSOR, HOST = "sensor", "host"
CLOCKS = (SENSOR, HOST)


@dataclass(frozen=True, kw_only=True)
class StreamTimeline:
    """The usable frames of a stream and their capture stamps."""

    frame: IntArray  # (k,) indices into the stream, in order of time
    time_ns: IntArray  # (k,) [ns] capture on the host's clock, strictly increasing
    counts: Mapping[str, int]  # frames left out or moved, by reason
    fit: ClockFit | None  # of the sensor's clock, if it was used

    def __len__(self) -> int:
        """The number of usable frames."""
        return len(self.frame)

    def gaps(self, longer_than_s: float) -> list[tuple[int, float]]:
        """Gaps in the stream: the stamp of the frame before each [ns] and its duration [s]."""
        interval_s = np.diff(self.time_ns) * 1e-9
        return [
            (int(self.time_ns[i]), float(interval_s[i]))
            for i in np.flatnonzero(interval_s > longer_than_s)
        ]


def make_timeline(stream: SensorStream, clock: str = SENSOR) -> StreamTimeline:
    """Compute the capture stamps of a stream's frames.

    Args:
        stream: The frames.
        clock: ``sensor`` keeps the spacing of the sensor's own clock, mapped onto the host's
            (the host's where the recording has no other); ``host`` uses the time of arrival.
    """
    counts = Counters("frames_repeated", "frames_out_of_order", "frames_reordered")
    counts.add("frames_reordered", stream.frames_sorted)
    order = np.arange(len(stream))
    time_ns, fit = stream.host_time_ns, None
    if stream.sensor_time_ns is not None and len(stream):
        fit = fit_clock(stream.sensor_time_ns, stream.host_time_ns)
        order = _without_repeated(fit.epoch, stream.sensor_time_ns)
        counts.add("frames_repeated", len(stream) - len(order))
        is_late, in_order = _sorted_in_epochs(order, fit.epoch, stream.sensor_time_ns)
        if clock == SENSOR:
            time_ns, order = fit.capture_ns, in_order
            counts.add("frames_reordered", int(is_late.sum()))
        else:
            counts.add("frames_out_of_order", int(is_late.sum()))
            order, fit = order[~is_late], None
    kept = order[_longest_increasing(time_ns[order])]
    dropped = np.setdiff1d(order, kept)
    repeated = int(np.isin(time_ns[dropped], time_ns[kept]).sum())
    counts.add("frames_repeated", repeated)
    counts.add("frames_out_of_order", len(dropped) - repeated)
    return StreamTimeline(frame=kept, time_ns=time_ns[kept], counts=counts.as_dict(), fit=fit)


def order_lines(stream: SensorStream, timeline: StreamTimeline) -> Iterator[str]:
    """Lines about frames that are left out, or were moved, for the times that the file gives."""
    name, repeated = stream.name, stream.rows_repeated
    if repeated:
        yield (
            f"sensor {name}: {repeated} of {len(stream.person) + repeated} rows left out: their "
            "time is that of another row of the same person; is the time column rounded?"
        )
    backwards = timeline.counts["frames_out_of_order"]
    if backwards:
        yield (
            f"sensor {name}: {backwards} of {len(stream)} frames left out: their time goes back; "
            "is the time column right?"
        )
    if stream.frames_sorted:
        yield (
            f"sensor {name}: {stream.frames_sorted} of {len(stream)} frames stood after later ones "
            "in the file: put in order of time"
        )


def _without_repeated(epoch: IntArray, sensor_ns: IntArray) -> IntArray:
    """Indices of the first occurrence of each sensor frame, in order of arrival."""
    _, first = np.unique(np.column_stack([epoch, sensor_ns]), axis=0, return_index=True)
    return np.sort(first)


def _sorted_in_epochs(
    order: IntArray, epoch: IntArray, sensor_ns: IntArray
) -> tuple[BoolArray, IntArray]:
    """Sort each epoch's frames by the sensor's clock, within the epoch's positions.

    Returns:
        Whether a later frame of the same epoch arrived before each one; and the sorted frames.
    """
    is_late, in_order = np.zeros(len(order), dtype=bool), order.copy()
    for number in np.unique(epoch):
        places = np.flatnonzero(epoch[order] == number)
        times = sensor_ns[order[places]]
        is_late[places] = times < np.maximum.accumulate(times)
        in_order[places] = order[places][np.argsort(times)]
    return is_late, in_order


def _longest_increasing(values: IntArray) -> IntArray:
    """Indices of the longest strictly increasing subsequence.

    Keeps the largest number of frames: a single stamp far ahead does not exclude those after it.
    """
    tails: list[int] = []  # the smallest value that ends a subsequence of each length
    ends: list[int] = []  # and its index
    previous = np.full(len(values), -1, dtype=np.int64)
    for i, value in enumerate(values.tolist()):
        place = bisect_left(tails, value)
        if place == len(tails):
            tails.append(value)
            ends.append(i)
        else:
            tails[place], ends[place] = value, i
        previous[i] = ends[place - 1] if place else -1
    chain = []
    i = ends[-1] if ends else -1
    while i >= 0:
        chain.append(i)
        i = int(previous[i])
    return np.array(chain[::-1], dtype=np.int64)
