"""Samples of a recording of any kind: a bag, or skeletons in a text file."""

from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from pose_core.api import ChosenPerson, ImuBlock, SkeletonSample
from pose_io.bag_samples import BagSamples
from pose_io.bags import BAG_SUFFIXES, open_bag
from pose_io.recordings.formats import AUTO, read_recording
from pose_io.recordings.stream_frames import samples_of_stream
from pose_io.topics import sensor_topics


@dataclass(frozen=True, kw_only=True)
class RecordedSamples:
    """One person's samples in a file."""

    sensors: tuple[str, ...]  # the skeletons' sensors
    samples: tuple[SkeletonSample | ImuBlock, ...]  # in the order of time; of a bag, of arrival


def read_samples(path: Path | str, format_name: str = AUTO) -> RecordedSamples:
    """Read a bag, or a text file of skeletons.

    Args:
        path: A rosbag2 folder, an ``.mcap`` or ``.db3`` file, or any of the formats of
            :data:`pose_io.recordings.formats.FORMATS`.
        format_name: The text file's format; ``auto``: known by its header.

    Raises:
        InputError: If the file is missing, damaged or holds no skeletons.
    """
    path = Path(path)
    if path.is_dir() or path.suffix in BAG_SUFFIXES:
        with open_bag(path) as bag:
            samples = tuple(BagSamples(bag))
            return RecordedSamples(sensors=tuple(sensor_topics(bag)), samples=samples)
    chosen = ChosenPerson()
    streams = read_recording(path, format_name).streams
    skeletons = [sample for each in streams for sample in samples_of_stream(each, chosen)]
    return RecordedSamples(
        sensors=tuple(each.name for each in streams),
        samples=tuple(sorted(skeletons, key=attrgetter("stamp_ns"))),
    )
