"""A recording of skeletons as frozen values, one stream per sensor.

Frames are unchanged from the file; :mod:`pose_io.recordings.timeline` selects those with a usable
stamp.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import JOINTS, TrackingState
from pose_io.arrays import ByteArray, IntArray
from pose_io.recordings.joint_maps import mark_missing


@dataclass(frozen=True, kw_only=True)
class SensorStream:
    """One sensor's data: m frames, r rows; a row is one person in one frame."""

    name: str
    host_time_ns: IntArray  # (m,) [ns] arrival on the host's clock
    sensor_time_ns: IntArray | None  # (m,) [ns] capture on the sensor's own clock, if recorded
    row_start: IntArray  # (m + 1,) frame i has the rows row_start[i]:row_start[i + 1]
    person: tuple[str, ...]  # r ids
    positions: FloatArray  # (r, 15, 3) [m] in the sensor's optical frame; NaN where not tracked
    tracking_state: ByteArray  # (r, 15), values of TrackingState
    rows_repeated: int = 0  # rows left out: the same person twice in one frame
    frames_sorted: int = 0  # frames that the file holds after a later one, put in order of time

    def __len__(self) -> int:
        """The number of frames."""
        return len(self.host_time_ns)

    @property
    def persons(self) -> tuple[str, ...]:
        """The ids of all persons, in order of appearance."""
        return tuple(dict.fromkeys(self.person))

    def rows(self, frame: int) -> range:
        """The rows of a frame, one per person; empty if the frame has no persons."""
        return range(int(self.row_start[frame]), int(self.row_start[frame + 1]))

    def joint_counts(self) -> dict[str, int]:
        """Number of joints by tracking state, over all rows."""
        counts = np.bincount(self.tracking_state.ravel(), minlength=len(TrackingState))
        return {state.name.lower(): int(counts[state]) for state in reversed(TrackingState)}


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Content of a recording: the streams of its sensors on one host clock."""

    source: str  # the file, for messages
    format: str
    streams: tuple[SensorStream, ...]  # in order of appearance
    time_zero_ns: int  # [ns] host time of the recording's beginning
    comments: tuple[str, ...] = ()  # comment lines of the file

    def stream(self, sensor: str) -> SensorStream:
        """Find a stream by its name, or by its index as a string.

        Raises:
            InputError: If there is no such sensor.
        """
        by_name = {stream.name: stream for stream in self.streams}
        if sensor in by_name:
            return by_name[sensor]
        if sensor.isdecimal() and int(sensor) < len(self.streams):
            return self.streams[int(sensor)]
        count = len(self.streams)
        raise InputError(
            f"recording has {count} sensor{'s' * (count != 1)} ({', '.join(by_name)}), sensor "
            f"'{sensor}' was asked for: give one of these names, an index from 0 to {count - 1}, "
            f"or another recording than {self.source}"
        )


def make_stream(
    name: str,
    *,
    host_time_ns: Sequence[int] | IntArray,
    sensor_time_ns: Sequence[int] | IntArray | None,
    person: Sequence[str],
    positions: FloatArray,
    tracking_state: ByteArray,
    sort_frames: bool = False,
) -> SensorStream:
    """Group rows, one per person, into frames.

    Rows with equal stamps are one frame, also if they are not adjacent; frames are in the order of
    first appearance, unless they are sorted. A joint without a position, or NOT_TRACKED, becomes
    NaN and NOT_TRACKED.

    Args:
        name: The sensor.
        host_time_ns: Arrival [ns], r values.
        sensor_time_ns: Capture on the sensor's own clock [ns], r values, or None.
        person: Person ids, r values; an empty id is a frame without persons.
        positions: In the sensor's optical frame [m], shape (r, 15, 3).
        tracking_state: Values of ``TrackingState``, shape (r, 15).
        sort_frames: Sort frames by ``host_time_ns``: the order of the rows is not that of arrival.
    """
    frames: dict[tuple[int, int], dict[str, int]] = {}
    repeated = 0
    sensor_times = [0] * len(person) if sensor_time_ns is None else sensor_time_ns
    for row, (host, sensor, who) in enumerate(
        zip(map(int, host_time_ns), map(int, sensor_times), person, strict=True)
    ):
        seen = frames.setdefault((host, sensor), {})
        if who in seen:
            repeated += 1
        elif who:
            seen[who] = row
    frames_sorted = 0
    if sort_frames:
        host_ns = np.array([host for host, _ in frames], dtype=np.int64)
        frames_sorted = int((host_ns < np.maximum.accumulate(host_ns)).sum())
        frames = dict(sorted(frames.items()))
    order = [row for seen in frames.values() for row in seen.values()]
    stamps = np.array(list(frames), dtype=np.int64).reshape(-1, 2)
    kept_positions = np.array(positions, dtype=np.float64).reshape(-1, len(JOINTS), 3)[order]
    kept_state = np.array(tracking_state, dtype=np.uint8).reshape(-1, len(JOINTS))[order]
    mark_missing(kept_positions, kept_state)
    return SensorStream(
        name=name,
        host_time_ns=stamps[:, 0],
        sensor_time_ns=None if sensor_time_ns is None else stamps[:, 1],
        row_start=np.cumsum([0, *(len(seen) for seen in frames.values())], dtype=np.int64),
        person=tuple(person[row] for row in order),
        positions=kept_positions,
        tracking_state=kept_state,
        rows_repeated=repeated,
        frames_sorted=frames_sorted,
    )


def make_recording(
    source: str,
    format_name: str,
    streams: Sequence[SensorStream],
    *,
    time_zero_ns: int | None = None,
    comments: Sequence[str] = (),
) -> Recording:
    """Create a recording; time zero is the earliest host time unless given.

    Raises:
        InputError: If there are no frames.
    """
    values = tuple(streams)
    if not any(len(stream) for stream in values):
        raise InputError(
            f"{source} holds no frames, only a header: expected one row a frame; record again"
        )
    if time_zero_ns is None:
        time_zero_ns = min(int(s.host_time_ns.min()) for s in values if len(s))
    return Recording(
        source=source,
        format=format_name,
        streams=values,
        time_zero_ns=time_zero_ns,
        comments=tuple(comments),
    )
