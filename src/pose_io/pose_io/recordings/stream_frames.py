"""Frames and samples of one sensor's stream in a recording, stamped as by ``kinect_bridge``."""

from collections.abc import Iterator

from pose_core.api import ChosenPerson, SkeletonSample
from pose_io.recordings.recording import SensorStream
from pose_io.recordings.timeline import make_timeline


def samples_of_stream(stream: SensorStream, chosen: ChosenPerson) -> list[SkeletonSample]:
    """One person's samples from a recorded sensor."""
    frames = frames_of_stream(stream)
    return [one for _, _, persons in frames for one in chosen.select(persons)]


def frames_of_stream(stream: SensorStream) -> Iterator[tuple[int, int, list[SkeletonSample]]]:
    """Index, stamp [ns] and persons of each frame."""
    timeline = make_timeline(stream)
    for frame, stamp_ns in zip(timeline.frame.tolist(), timeline.time_ns.tolist(), strict=True):
        persons = [
            SkeletonSample(
                stamp_ns=stamp_ns,
                sensor=stream.name,
                person=stream.person[row],
                positions=stream.positions[row],
                tracking_state=stream.tracking_state[row],
            )
            for row in stream.rows(frame)
        ]
        yield frame, stamp_ns, persons
