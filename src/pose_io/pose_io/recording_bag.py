"""Conversion of a recording of skeletons to the bag that the bridges would have recorded.

Stamps are those of the live bridges: capture on the host's clock, mapped by
:mod:`pose_io.recordings.timeline`. A recording without UNIX time begins at 2001-09-09.
"""

import re
from collections.abc import Sequence
from heapq import merge
from pathlib import Path
from typing import Any

from pose_core.stamps import NS_PER_S
from pose_io.bag_writer import BagWriter
from pose_io.message_maker import MessageMaker
from pose_io.names import SKELETON_ARRAY, sensor_frame, skeletons_topic
from pose_io.recordings.recording import Recording, SensorStream
from pose_io.recordings.stream_frames import frames_of_stream

USUAL_NAMES = ("left", "right")
NAME = re.compile(r"[A-Za-z0-9]\w*", re.ASCII)  # names that a topic may contain
EARLIEST_NS = 10**9 * NS_PER_S  # [ns] before this, a host's clock is no UNIX time
LATEST_NS = 2**31 * NS_PER_S  # [ns] that a stamp can hold


def write_recording_bag(recording: Recording, path: Path) -> None:
    """Write all frames with a usable stamp as ``/kinect_<name>/skeletons``.

    Raises:
        InputError: If the bag cannot be written.
    """
    first_ns = recording.time_zero_ns
    shift_ns = 0 if EARLIEST_NS <= first_ns < LATEST_NS else EARLIEST_NS - first_ns
    with BagWriter(path) as bag:
        names = sensor_names([stream.name for stream in recording.streams])
        streams = []
        for stream, name in zip(recording.streams, names, strict=True):
            bag.add_topic(f"/{skeletons_topic(name)}", SKELETON_ARRAY, reliable=False, depth=5)
            streams.append(_messages(stream, name, shift_ns, MessageMaker(bag.typestore)))
        for stamp_ns, topic, message in merge(*streams, key=lambda entry: entry[0]):
            bag.write(topic, message, stamp_ns)


def sensor_names(names: Sequence[str]) -> tuple[str, ...]:
    """Names of the sensors in topics: those of the recording, if all are valid in topics.

    Otherwise, for example for addresses, they become ``left``, ``right``, ``sensor_2``, in the
    file's order.
    """
    if all(NAME.fullmatch(name) for name in names):
        return tuple(names)
    numbered = (f"sensor_{number}" for number in range(len(USUAL_NAMES), len(names)))
    return (*USUAL_NAMES[: len(names)], *numbered)


def renaming_lines(names: Sequence[str]) -> list[str]:
    """A line about the sensors whose names are not those of the recording, if there are any."""
    ours = sensor_names(names)
    if ours == tuple(names):
        return []
    pairs = (f"{our} is {name or 'without a name'}" for our, name in zip(ours, names, strict=True))
    return [f"sensors, in the file's order: {', '.join(pairs)}"]


def _messages(stream: SensorStream, name: str, shift_ns: int, make: MessageMaker) -> Any:
    """Stamp [ns], topic and message of each frame, in order of time."""
    topic, frame_id = f"/{skeletons_topic(name)}", sensor_frame(name)
    for _, time_ns, persons in frames_of_stream(stream):
        header = make.header(time_ns + shift_ns, frame_id)
        yield time_ns + shift_ns, topic, make.frame(header, persons)
