"""What a bag holds, as samples: skeletons, IMUs, extrinsics and the fused output.

Works on the messages of ``pose_common.bags``, and needs no ROS. Topics are recognised by the end
of their names, in any namespace.
"""

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_common.bags import BagMessage, BagReader
from pose_common.counters import Counters
from pose_common.errors import InputError
from pose_common.joints import JOINT_INDEX, TrackingState
from pose_common.mcap import Entry
from pose_fusion.streams.imu_bytes import imu_block
from pose_fusion.streams.person_selection import PersonSelector
from pose_fusion.streams.samples import FloatArray, ImuBlock, SkeletonSample
from pose_fusion.streams.series import SkeletonSeries, series_from_samples
from pose_fusion.streams.skeleton_bytes import Persons, SkeletonReader, clean_joints

NS_PER_S = 1_000_000_000
SENSOR_TOPIC = re.compile(r"(?:^|/)kinect_(?P<name>\w+)/skeletons$")
IMU_TOPIC = re.compile(r"(?:^|/)imu_(?P<name>\w+)/data$")
SENSOR_FRAME = re.compile(r"^kinect_(?P<name>\w+)_optical_frame$")
WORLD_FRAME = "map"

Progress = Callable[[float], None]
"""Called with the share of the bag that has been read, 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class EstimateSeries:
    """The fusion's own account of each of its outputs."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    names: tuple[str, ...]  # (k,) the degrees of freedom
    position: FloatArray  # (n, k) [m] or [rad]
    position_stddev: FloatArray  # (n, k) [m] or [rad]
    weight_kinect: FloatArray  # (n, k) [-] 0..1
    weight_imu: FloatArray  # (n, k) [-] 0..1
    source: NDArray[np.uint8]  # (n, k) where each came from: 0 predicted, 1 Kinect, 2 IMU, 3 both
    latency_s: FloatArray  # (n,) [s]


def stamp_ns(header: Any) -> int:
    """Nanoseconds of a message's header."""
    return int(header.stamp.sec) * NS_PER_S + int(header.stamp.nanosec)


def sensor_topics(bag: BagReader) -> dict[str, str]:
    """Topic of each sensor's skeletons by the sensor's name, in the order of names."""
    return _topics(bag, SENSOR_TOPIC, "pose_msgs/msg/SkeletonArray")


def imu_topics(bag: BagReader) -> dict[str, str]:
    """Topic of each IMU's orientation by body segment, in the order of names."""
    return _topics(bag, IMU_TOPIC, "sensor_msgs/msg/Imu")


def body_topic(bag: BagReader, leaf: str, body: str = "", namespace: str = "") -> str | None:
    """The topic ``<namespace>/humans/bodies/<body>/<leaf>``; the first body if none is named."""
    pattern = re.compile(
        rf"^{re.escape(namespace)}/humans/bodies/{re.escape(body) or '[^/]+'}/{leaf}$"
    )
    return next((name for name in sorted(bag.topics) if pattern.match(name)), None)


class BagSamples:
    """The sensors' samples of one person, in the order in which the bag recorded them.

    Iterating reads on as it is asked: memory does not depend on the bag's length.

    Args:
        bag: An open bag.
        person: The id of the person to follow in all sensors; see :class:`PersonSelector`.
        progress: Called now and then.
        selector: How the person is chosen, instead of by ``person``.
        imus: Read the IMUs too.

    Raises:
        InputError: If the bag holds no skeletons, or is damaged.
    """

    def __init__(
        self,
        bag: BagReader,
        person: str = "",
        progress: Progress | None = None,
        *,
        selector: PersonSelector | None = None,
        imus: bool = True,
    ) -> None:
        self._bag = bag
        self._sensors = {topic: name for name, topic in sensor_topics(bag).items()}
        self._imus = {topic: name for name, topic in imu_topics(bag).items() if imus}
        self._progress = progress or (lambda _: None)
        self._selector = selector or PersonSelector(person)
        self.counters = Counters("frames", "malformed_frames", "imu", "imu_without_orientation")
        self.person_counters = self._selector.counters
        self._readers = {topic: SkeletonReader(name) for topic, name in self._sensors.items()}
        topics = (*self._sensors, *self._imus)
        self._as_ours = {t for t in topics if bag.is_defined_as_ours(bag.topics[t].msgtype)}
        if not self._sensors:
            raise InputError(
                f"{bag.path} holds no skeletons: expected topics kinect_<name>/skeletons of "
                f"pose_msgs/SkeletonArray, found {', '.join(sorted(bag.topics))}"
            )

    def __iter__(self) -> Iterator[SkeletonSample | ImuBlock]:
        span_ns = max(1, self._bag.end_ns - self._bag.start_ns)
        for batch in self._bag.batches([*self._sensors, *self._imus]):
            self._progress((batch[0][1] - self._bag.start_ns) / span_ns)
            yield from self._in_turns(batch)
        self._progress(1.0)

    def _in_turns(self, batch: list[Entry]) -> Iterator[SkeletonSample | ImuBlock]:
        """The batch's samples: IMUs' that came between two frames together."""
        places: dict[str, list[int]] = defaultdict(list)
        for place, (connection, _, _) in enumerate(batch):
            places[connection.topic].append(place)
        block, block_places = self._imu_rows(batch, places)
        frames = sorted(
            (place, persons)
            for topic in self._sensors
            for place, persons in self._frames(topic, batch, places[topic])
        )
        stops = np.searchsorted(block_places, [place for place, _ in frames]).tolist()
        start = 0
        for stop, (_, persons) in zip(stops, frames, strict=True):
            if start < stop:
                yield block.rows(slice(start, stop))
                start = stop
            sample = self._person(persons)
            if sample is not None:
                yield sample
        if start < len(block):
            yield block.rows(slice(start, None))

    def _imu_rows(
        self, batch: list[Entry], places: Mapping[str, list[int]]
    ) -> tuple[ImuBlock, NDArray[np.intp]]:
        """All IMUs' samples in the order of their recording, and their places in the batch."""
        own = {topic: places.get(topic, []) for topic in self._imus}
        datas = {s: self._bytes(topic, batch, own[topic]) for topic, s in self._imus.items()}
        block, rows = imu_block(datas)
        place = np.array([place for each in own.values() for place in each], np.intp)
        self.counters.add("imu", len(place))
        self.counters.add("imu_without_orientation", len(place) - len(rows))
        order = np.argsort(place[rows])
        return block.rows(order), place[rows][order]

    def _frames(
        self, topic: str, batch: list[Entry], places: list[int]
    ) -> Iterable[tuple[int, Persons | InputError]]:
        datas = self._bytes(topic, batch, places)
        return zip(places, self._readers[topic].read(datas), strict=True)

    def _person(self, persons: Persons | InputError) -> SkeletonSample | None:
        self.counters.add("frames")
        if isinstance(persons, InputError):
            self.counters.add("malformed_frames")
            return None
        return self._selector.select(persons)

    def _bytes(self, topic: str, batch: list[Entry], places: list[int]) -> list[bytes]:
        """The messages of a topic; those of another definition as ours would be."""
        if topic in self._as_ours:
            return [batch[place][2] for place in places]
        messages = (
            BagMessage(topic=topic, msgtype=each.msgtype, stamp_ns=stamp_ns, data=data)
            for each, stamp_ns, data in (batch[place] for place in places)
        )
        return [self._bag.in_our_bytes(message) for message in messages]


def read_sensor_series(bag: BagReader, person: str = "") -> dict[str, SkeletonSeries]:
    """Every sensor's view of the person, each in the sensor's own frame, by sensor name."""
    samples: dict[str, list[SkeletonSample]] = {name: [] for name in sensor_topics(bag)}
    for sample in BagSamples(bag, person, imus=False):
        if isinstance(sample, SkeletonSample):
            samples[sample.sensor].append(sample)
    return {name: series_from_samples(each) for name, each in samples.items()}


def read_body_series(bag: BagReader, body: str = "", namespace: str = "") -> SkeletonSeries:
    """A body's skeleton in ``map``: fused, or the truth of a synthetic subject.

    Raises:
        InputError: If the bag holds none.
    """
    topic = body_topic(bag, "skeleton", body, namespace)
    if topic is None:
        raise InputError(
            f"{bag.path} holds no {namespace}/humans/bodies/{body or '<id>'}/skeleton: "
            f"found {', '.join(sorted(bag.topics))}"
        )
    return series_from_samples(
        skeleton_sample(bag.deserialize(message), "") for message in bag.messages([topic])
    )


def read_estimates(bag: BagReader, body: str = "") -> EstimateSeries:
    """The ``estimate`` messages of a body; of no rows if the bag holds none."""
    topic = body_topic(bag, "estimate", body)
    messages = [] if topic is None else [bag.deserialize(m) for m in bag.messages([topic])]
    names = tuple(messages[0].name) if messages else ()
    messages = [m for m in messages if tuple(m.name) == names]

    def column(field: str) -> FloatArray:
        values = [getattr(m, field) for m in messages]
        return np.array(values, float).reshape(len(messages), len(names))

    return EstimateSeries(
        stamps_ns=np.array([stamp_ns(m.header) for m in messages], np.int64),
        names=names,
        position=column("position"),
        position_stddev=column("position_stddev"),
        weight_kinect=column("weight_kinect"),
        weight_imu=column("weight_imu"),
        source=column("state").astype(np.uint8),
        latency_s=np.array([m.latency for m in messages], float),
    )


def read_extrinsics(bag: BagReader, topic: str = "/tf_static") -> dict[str, FloatArray]:
    """``T_map_sensor``, (4, 4), of each Kinect in the static transforms, by sensor name.

    The last transform of a frame counts. Sensors without a path to ``map`` are left out; no
    transforms at all give an empty result.
    """
    return transforms_to_map(
        transform
        for message in bag.messages([topic])
        for transform in bag.deserialize(message).transforms
    )


def transforms_to_map(transforms: Iterable[Any]) -> dict[str, FloatArray]:
    """``T_map_sensor``, (4, 4), of each Kinect among ``geometry_msgs/TransformStamped``.

    The last transform of a frame counts. Sensors without a path to ``map`` are left out.

    Raises:
        InputError: If a transform on such a path has no rotation or no numbers.
    """
    parents = {transform.child_frame_id: transform for transform in transforms}
    result = {}
    for frame in sorted(parents):
        match = SENSOR_FRAME.match(frame)
        T_map_sensor = _to_world(frame, parents) if match else None
        if match and T_map_sensor is not None:
            result[match["name"]] = T_map_sensor
    return result


def skeleton_samples(message: Any, sensor: str) -> list[SkeletonSample]:
    """The persons of a ``pose_msgs/SkeletonArray`` (of ROS or of rosbags)."""
    return [skeleton_sample(skeleton, sensor) for skeleton in message.skeletons]


def skeleton_sample(message: Any, sensor: str) -> SkeletonSample:
    """A ``pose_msgs/Skeleton``; what it does not name or place is NaN and not tracked.

    Raises:
        InputError: If its lists differ in length, or a tracking state is none of the three.
    """
    count = len(message.name)
    if len(message.position) != count or len(message.tracking_state) != count:
        raise InputError(
            f"skeleton '{message.id}' has {count} names, {len(message.position)} positions and "
            f"{len(message.tracking_state)} tracking states: expected as many of each"
        )
    strange = set(message.tracking_state) - set(TrackingState)
    if strange:
        raise InputError(
            f"skeleton '{message.id}' has the tracking state {min(strange)}: expected 0 (not "
            "tracked), 1 (inferred) or 2 (tracked)"
        )
    ours = {JOINT_INDEX[n]: index for index, n in enumerate(message.name) if n in JOINT_INDEX}
    named = list(ours.values())
    xyz = np.array([(p.x, p.y, p.z) for p in message.position], float).reshape(1, -1, 3)
    states = np.array(message.tracking_state, np.uint8).reshape(1, -1)
    (positions,), (state,) = clean_joints(xyz[:, named], states[:, named], np.array([*ours], int))
    return SkeletonSample(
        stamp_ns=stamp_ns(message.header),
        sensor=sensor,
        person=message.id,
        positions=positions,
        tracking_state=state,
    )


def _topics(bag: BagReader, pattern: re.Pattern[str], msgtype: str) -> dict[str, str]:
    matches = {topic: pattern.search(topic) for topic in sorted(bag.topics_of_type(msgtype))}
    named: dict[str, str] = {}
    for topic, match in matches.items():
        if match is None:
            continue
        name = match["name"]
        if name in named:
            raise InputError(
                f"{bag.path} holds '{name}' twice, as {named[name]} and {topic}: record or "
                "play one of them alone"
            )
        named[name] = topic
    return dict(sorted(named.items()))


def _matrix(transform: Any) -> FloatArray:
    """The (4, 4) matrix of a ``geometry_msgs/TransformStamped``."""
    q, t = transform.transform.rotation, transform.transform.translation
    matrix = np.eye(4)
    try:
        matrix[:3, :3] = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    except ValueError as error:
        raise InputError(
            f"the transform of {transform.child_frame_id} has no rotation: its quaternion is zero"
        ) from error
    matrix[:3, 3] = t.x, t.y, t.z
    if not np.isfinite(matrix).all():
        raise InputError(f"the transform of {transform.child_frame_id} holds NaN or infinity")
    return matrix


def _to_world(frame: str, parents: Mapping[str, Any]) -> FloatArray | None:
    T_world_frame = np.eye(4)
    for _ in range(len(parents) + 1):  # a loop of frames ends too
        if frame == WORLD_FRAME:
            return T_world_frame
        if frame not in parents:
            return None
        T_world_frame = _matrix(parents[frame]) @ T_world_frame
        frame = parents[frame].header.frame_id
    return None
