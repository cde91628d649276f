"""Samples read from a bag: skeletons, IMUs, extrinsics and the fused output.

Works on the messages of ``pose_io.bags``, and needs no ROS.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pose_core.api import (
    ChosenPerson,
    Clocks,
    ClockSteps,
    EstimateSeries,
    Extrinsics,
    ImuBlock,
    RecordingOrder,
    SkeletonSample,
    SkeletonSeries,
    estimate_series,
    interleaved,
    series_from_samples,
)
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.stamps import nanoseconds
from pose_io.bags import BagMessage, BagReader, Progress
from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.skeleton_bytes import Persons, SkeletonReader
from pose_io.names import BODIES
from pose_io.skeleton_messages import skeleton_sample
from pose_io.static_transforms import transforms_to_map
from pose_io.topics import (
    IMU,
    body_topic,
    imu_topics,
    misnamed_imu_topics,
    sensor_topics,
    static_transform_topics,
)


class BagFrames:
    """Frames of all sensors with all persons, in the order of their recording or of their stamps.

    The bag is read incrementally: memory does not depend on its length. Stamps are corrected from
    where a source's clock was set while it recorded; see :class:`ClockSteps`.

    Args:
        bag: An open bag.
        progress: Called from time to time with the fraction read.
        imus: Whether to read the IMUs too.
        clocks: Clocks of the sources, for the order of stamps; None: the order of recording.

    Raises:
        InputError: If the bag contains no skeletons, or is damaged.
    """

    def __init__(
        self,
        bag: BagReader,
        progress: Progress | None = None,
        *,
        imus: bool = True,
        clocks: Clocks | None = None,
    ) -> None:
        self._bag = bag
        self._order = None if clocks is None else RecordingOrder(clocks)
        self._sensors = {topic: name for name, topic in sensor_topics(bag).items()}
        self._imus = {topic: name for name, topic in imu_topics(bag).items() if imus}
        self._misnamed = misnamed_imu_topics(bag.topics_of_type(IMU)) if imus else []
        self._without_orientation: Counter[str] = Counter()  # samples by topic
        self._clock_steps = ClockSteps()
        self._progress = progress or (lambda _: None)
        self._malformed: Counter[str] = Counter()  # frames by topic
        self._first_errors: dict[str, str] = {}  # of these, by topic
        self._readers = {topic: SkeletonReader(name) for topic, name in self._sensors.items()}
        topics = (*self._sensors, *self._imus)
        self._as_ours = {t for t in topics if bag.is_defined_as_ours(bag.topics[t].msgtype)}
        if not self._sensors:
            raise InputError(
                f"{bag.path} holds no skeletons: expected topics kinect_<name>/skeletons of "
                f"pose_msgs/SkeletonArray, found {', '.join(sorted(bag.topics))}"
            )

    def __iter__(self) -> Iterator[Sequence[SkeletonSample] | ImuBlock]:
        order = self._order
        for batch in self._bag.batches([*self._sensors, *self._imus]):
            self._progress(self._bag.share_before(batch[0].stamp_ns))
            frames, block, places = self._sorted(batch)
            if order is None:
                stops = np.searchsorted(places, [place for place, _ in frames])
                yield from interleaved((persons for _, persons in frames), block, stops)
            else:
                yield from order.add(frames, block, places)
        if order is not None:
            yield from order.flush()
        self._progress(1.0)

    @property
    def left_out(self) -> Sequence[str]:
        """Lines about what was left out or corrected: samples, names, clocks that were set."""
        lines = [
            f"{topic}: {fault} (messages: {count})"
            for topic, reader in self._readers.items()
            for fault, count in reader.faults.items()
        ]
        lines += [
            f"{topic}: {count} malformed frames left out, the first: {self._first_errors[topic]}"
            for topic, count in self._malformed.items()
        ]
        if self._without_orientation:
            topics = ", ".join(sorted(self._without_orientation))
            lines.append(
                f"IMUs: {self._without_orientation.total()} samples left out, without an "
                f"orientation (covariance −1, or NaN): {topics}: publish orientations, for example "
                "with imu_filter_madgwick"
            )
        if self._misnamed:
            lines.append(
                f"IMUs: topics not used: {', '.join(self._misnamed)}: record them as "
                "imu_<segment>/data, or add, for example, "
                f"--remap {self._misnamed[0]}:=/imu_left_thigh/data"
            )
        lines += self._clock_steps.lines(self._bag.start_ns)
        return [*lines, *(() if self._order is None else self._order.left_out)]

    def _sorted(
        self, batch: list[BagMessage]
    ) -> tuple[list[tuple[int, Persons]], ImuBlock, NDArray[np.intp]]:
        """A batch's frames with their places in it, and the samples of IMUs with theirs."""
        places: dict[str, list[int]] = defaultdict(list)
        for place, message in enumerate(batch):
            places[message.connection.topic].append(place)
        block, block_places = self._imu_rows(batch, places)
        found = [
            (place, persons)
            for topic in self._sensors
            for place, persons in self._frames(topic, batch, places[topic])
        ]
        return sorted(found), block, block_places

    def _imu_rows(
        self, batch: list[BagMessage], places: Mapping[str, list[int]]
    ) -> tuple[ImuBlock, NDArray[np.intp]]:
        """Samples of all IMUs in the order of their recording, and their indices in the batch."""
        own = {topic: places.get(topic, []) for topic in self._imus}
        datas = {s: self._bytes(topic, batch, own[topic]) for topic, s in self._imus.items()}
        block, rows = imu_block(datas)
        place = np.array([place for each in own.values() for place in each], np.intp)
        if len(rows) < len(place):
            topics = np.repeat(list(own), [len(each) for each in own.values()])
            self._without_orientation.update(np.delete(topics, rows).tolist())
        order = np.argsort(place[rows])
        block, places_of_rows = block.rows(order), place[rows][order]
        return self._with_steps_corrected(block, batch, places_of_rows), places_of_rows

    def _with_steps_corrected(
        self, block: ImuBlock, batch: list[BagMessage], places: NDArray[np.intp]
    ) -> ImuBlock:
        """The block, its stamps corrected where a clock was set."""
        recorded_ns = np.array([batch[place].stamp_ns for place in places.tolist()], np.int64)
        offsets_ns = np.zeros_like(recorded_ns)
        for imu, segment in enumerate(block.segments):
            own = block.imu == imu
            offsets_ns[own] = self._clock_steps.offsets_ns(
                f"imu/{segment}", block.stamps_ns[own], recorded_ns[own]
            )
        return replace(block, stamps_ns=block.stamps_ns + offsets_ns) if offsets_ns.any() else block

    def _frames(
        self, topic: str, batch: list[BagMessage], places: list[int]
    ) -> Iterable[tuple[int, Persons]]:
        datas = self._bytes(topic, batch, places)
        found: list[tuple[int, Persons]] = []
        for place, persons in zip(places, self._readers[topic].read(datas), strict=True):
            if isinstance(persons, InputError):
                self._malformed[topic] += 1
                self._first_errors.setdefault(topic, str(persons))
            else:
                found.append((place, persons))
        full = [(place, persons) for place, persons in found if persons]
        offsets_ns = self._clock_steps.offsets_ns(
            self._sensors[topic],
            [persons[0].stamp_ns for _, persons in full],
            [batch[place].stamp_ns for place, _ in full],
        )
        for (_, persons), offset_ns in zip(full, offsets_ns.tolist(), strict=True):
            if offset_ns:
                persons[:] = [replace(p, stamp_ns=p.stamp_ns + offset_ns) for p in persons]
        return found

    def _bytes(self, topic: str, batch: list[BagMessage], places: list[int]) -> list[bytes]:
        """Serialised messages of a topic, converted to this version's message definition."""
        if topic in self._as_ours:
            return [batch[place].data for place in places]
        return [self._bag.in_our_bytes(batch[place]) for place in places]


class BagSamples:
    """The sensors' samples of one person, in the order in which the bag recorded them.

    Args:
        bag: An open bag.
        person: The person to select; see :class:`PersonChoice`.
        progress: Called from time to time with the fraction read.
        extrinsics: Poses of the sensors; without them, each sensor selects a person.
        imus: Whether to read the IMUs too.

    Raises:
        InputError: If the bag contains no skeletons, or is damaged.
    """

    def __init__(
        self,
        bag: BagReader,
        person: str = "",
        progress: Progress | None = None,
        *,
        extrinsics: Extrinsics | None = None,
        imus: bool = True,
    ) -> None:
        self._frames = BagFrames(bag, progress, imus=imus)
        self._chosen = ChosenPerson(person, extrinsics)

    @property
    def left_out(self) -> Sequence[str]:
        """Lines about what was left out or corrected, see :class:`BagFrames`."""
        return self._frames.left_out

    def __iter__(self) -> Iterator[SkeletonSample | ImuBlock]:
        for each in self._frames:
            if isinstance(each, ImuBlock):
                self._chosen.add_imus(each)
                yield each
            else:
                yield from self._chosen.select(each)


def read_sensor_series(
    bag: BagReader, person: str = "", extrinsics: Extrinsics | None = None
) -> dict[str, SkeletonSeries]:
    """Skeletons of one person from each sensor, in the sensor's frame, by sensor name.

    Args:
        bag: An open bag.
        person: The person to select; see :class:`PersonChoice`.
        extrinsics: Poses of the sensors; without them, a person is selected for each sensor.
    """
    samples: dict[str, list[SkeletonSample]] = {name: [] for name in sensor_topics(bag)}
    for sample in BagSamples(bag, person, extrinsics=extrinsics, imus=False):
        if isinstance(sample, SkeletonSample):
            samples[sample.sensor].append(sample)
    return {name: series_from_samples(each) for name, each in samples.items()}


def read_body_series(bag: BagReader, body: str = "", namespace: str = "") -> SkeletonSeries:
    """Skeletons of a body in ``map``: the fused ones, or the true ones of a synthetic subject.

    Raises:
        InputError: If the bag contains none.
    """
    topic = body_topic(bag, "skeleton", body, namespace)
    if topic is None:
        raise InputError(
            f"{bag.path} holds no {namespace}{BODIES}{body or '<id>'}/skeleton: "
            f"found {', '.join(sorted(bag.topics))}"
        )
    return series_from_samples(
        skeleton_sample(bag.deserialize(message), "") for message in bag.messages([topic])
    )


def read_estimates(bag: BagReader, body: str = "") -> EstimateSeries:
    """The ``estimate`` messages of a body; an empty series if the bag contains none."""
    topic = body_topic(bag, "estimate", body)
    messages = [] if topic is None else [bag.deserialize(m) for m in bag.messages([topic])]
    names = tuple(messages[0].name) if messages else ()
    messages = [m for m in messages if tuple(m.name) == names]
    return estimate_series(
        messages,
        names,
        stamps_ns=[nanoseconds(message.header.stamp) for message in messages],
        sources=[message.state for message in messages],
        latencies_s=[message.latency for message in messages],
    )


def read_extrinsics(bag: BagReader) -> dict[str, FloatArray]:
    """``T_map_sensor``, (4, 4), of each Kinect in the static transforms, by sensor name.

    The last transform of a frame is used. Sensors without a path to ``map`` are left out;
    without any transforms the result is empty.
    """
    return transforms_to_map(
        transform
        for message in bag.messages(static_transform_topics(bag))
        for transform in bag.deserialize(message).transforms
    )
