"""A recording as snapshots at any time."""

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from operator import attrgetter, itemgetter
from typing import Any, TypeVar

from pose_core.api import FloatArray, ImuUse, SkeletonSample
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_io.bag_samples import read_extrinsics
from pose_io.bags import BagReader, Progress
from pose_io.names import BODIES
from pose_io.skeleton_messages import skeleton_samples
from pose_io.topics import body_topics, imu_topics, sensor_topics
from pose_view.curves import BodyTrack, track_of
from pose_view.messages import body_snapshot, dof_snapshot, link_rotations
from pose_view.recorded_fusion import read_statuses, recorded_fusion
from pose_view.snapshot import BodySnapshot, DofSnapshot, Snapshot, occluded_joints

T = TypeVar("T")
MAX_HOLD_S = 0.5  # [s] for which data are shown without an update


Stamped = list[tuple[int, T]]
"""Items with their stamps [ns], in ascending order."""
STAMP = itemgetter(0)


def latest(streams: Mapping[str, Stamped[T]], stamp_ns: int) -> dict[str, T]:
    """Each stream's last item up to a stamp [ns], unless older than :data:`MAX_HOLD_S`."""
    found = {}
    for name, entries in streams.items():
        index = bisect_right(entries, stamp_ns, key=STAMP) - 1
        if index >= 0 and stamp_ns - entries[index][0] <= MAX_HOLD_S * NS_PER_S:
            found[name] = entries[index][1]
    return found


class Recorded:
    """A bag's content as snapshots.

    Args:
        bag: An open bag, which is read completely.
        progress: Called from time to time with the fraction read.

    Raises:
        InputError: If it contains nothing to show.
    """

    def __init__(self, bag: BagReader, progress: Progress | None = None) -> None:
        self.path = bag.path
        self.sensors: dict[str, FloatArray] = read_extrinsics(bag)
        self.bodies: dict[str, Stamped[BodySnapshot]] = defaultdict(list)
        self.raw: dict[str, Stamped[tuple[SkeletonSample, ...]]] = defaultdict(list)
        self._dof: dict[tuple[str, int], DofSnapshot] = {}
        self._rotations: dict[tuple[str, int], dict[str, FloatArray]] = {}
        said = recorded_fusion(bag, read_statuses(bag))
        self.remarks = [f"IMU {name}: {why}" for name, why in said.unused.items()]
        """Lines on IMUs that are not used or faulty, bodies that are absent, samples left out."""
        self._named_imus = set(said.unused)
        self._used_from_ns = dict(said.used_from_ns)
        sent = {name for name, topic in imu_topics(bag).items() if bag.topics[topic].count}
        self.has_imus = bool(sent or self._used_from_ns)
        self._read(bag, progress or (lambda _: None))
        if not self.bodies and not self.raw:
            raise InputError(
                f"{bag.path} holds nothing to show: expected {BODIES}<id>/skeleton or"
                f" kinect_<name>/skeletons, found {', '.join(sorted(bag.topics))}"
            )
        series: list[Stamped[Any]] = [*self.bodies.values(), *self.raw.values()]
        self.start_ns = min(entries[0][0] for entries in series)
        self.end_ns = max(entries[-1][0] for entries in series)

    @property
    def duration_s(self) -> float:
        """Time between the first and the last item [s]."""
        return (self.end_ns - self.start_ns) / NS_PER_S

    def add_body(self, body: str, snapshots: list[BodySnapshot]) -> None:
        """Add the poses of a body, in the order of their stamps."""
        first = {name: self.raw[name] for name in sorted(self.raw)[:1]}
        for pose in snapshots:
            if first:
                seen = next(iter(latest(first, pose.stamp_ns).values()), ())
                pose = replace(pose, is_occluded=occluded_joints(seen, pose.stamp_ns))
            self.bodies[body].append((pose.stamp_ns, pose))

    def add_imu_uses(self, body: str, uses: Iterable[ImuUse]) -> None:
        """Add the state of use of the IMUs at the end of a body's computation; names each once."""
        for use in uses:
            if (use.reason or use.remark) and use.segment not in self._named_imus:
                self._named_imus.add(use.segment)
                self.remarks.append(f"{body}: IMU {use}")
            if use.is_aligned:
                first_ns = min(use.alignments_ns, default=use.start_ns)
                self._used_from_ns.setdefault(use.segment, first_ns)

    def snapshot(self, time_s: float) -> Snapshot:
        """The snapshot at a time after the start [s]."""
        now_ns = self.start_ns + round(time_s * NS_PER_S)
        bodies, raw = latest(self.bodies, now_ns), latest(self.raw, now_ns)
        imus = tuple(name for name, from_ns in self._used_from_ns.items() if from_ns <= now_ns)
        return Snapshot(bodies=bodies, sensors=self.sensors, raw=raw, imus=imus)

    def track(self, body: str, start_s: float, end_s: float) -> BodyTrack:
        """History of one body between two times after the start [s]."""
        first, last = (self.start_ns + round(t * NS_PER_S) for t in (start_s, end_s))
        known = self.bodies.get(body, [])
        rows = slice(bisect_left(known, first, key=STAMP), bisect_right(known, last, key=STAMP))
        return track_of([pose for _, pose in known[rows]], self.start_ns)

    def _read(self, bag: BagReader, progress: Progress) -> None:
        sensors = {topic: name for name, topic in sensor_topics(bag).items()}
        bodies = {
            topic: (body, leaf)
            for leaf in ("skeleton", "estimate")
            for body, topic in body_topics(bag, leaf).items()
        }
        links = [t for t in bag.topics_of_type("tf2_msgs/msg/TFMessage") if t.endswith("/tf")]
        wanted = [*sensors, *bodies, *links]
        skeletons: list[tuple[str, Any]] = []
        for index, message in enumerate(bag.messages(wanted)):
            if index % 64 == 0:
                progress(bag.share_before(message.stamp_ns))
            content = bag.deserialize(message)
            if message.topic in sensors:
                self._add_raw(sensors[message.topic], content)
            elif message.topic in bodies:
                body, leaf = bodies[message.topic]
                if leaf == "skeleton":
                    skeletons.append((body, content))
                else:
                    self._dof[body, nanoseconds(content.header.stamp)] = dof_snapshot(content)
            elif (found := link_rotations(content)) is not None:
                self._rotations[found[:2]] = found[2]
        # After all estimates and links, which belong to the skeletons of the same instants.
        poses: dict[str, list[BodySnapshot]] = defaultdict(list)
        for body, skeleton in skeletons:
            key = body, nanoseconds(skeleton.header.stamp)
            pose = body_snapshot(skeleton, self._dof.get(key), self._rotations.get(key))
            poses[body].append(pose)
        for entries in self.raw.values():
            entries.sort(key=STAMP)
        for body, snapshots in poses.items():
            self.add_body(body, sorted(snapshots, key=attrgetter("stamp_ns")))
        progress(1.0)

    def _add_raw(self, sensor: str, content: Any) -> None:
        try:
            seen = skeleton_samples(content, sensor)
        except InputError:
            return  # the fusion has counted it
        if seen:
            self.raw[sensor].append((seen[0].stamp_ns, tuple(seen)))
