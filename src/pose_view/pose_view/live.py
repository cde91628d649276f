"""State of a live graph for display, collected from its messages."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pose_core.api import FloatArray, SkeletonSample
from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_fusion.watching.observation import TopicWatch
from pose_io.skeleton_messages import skeleton_samples
from pose_io.static_transforms import StaticTransforms
from pose_node.node_status import NodeStatus
from pose_view.curves import BodyTrack, track_of
from pose_view.messages import body_snapshot, dof_snapshot, link_rotations
from pose_view.plain_words import StatusLine, imu_line, node_line, stream_line
from pose_view.robot import JointHistory, JointTrack, RobotSnapshot, robot_places, robot_shape
from pose_view.snapshot import BodySnapshot, DofSnapshot, Snapshot, occluded_joints

RESTART_S = 1.0  # [s] a larger step back in time means a restart
RATE_WINDOW_S = 2.0  # [s] over which rates and delays are averaged
HOLD_S = 1.0  # [s] for which data are shown without an update
OTHER_NODES = {
    "fusion_kinect": "Fusion of the Kinects alone",
    "fusion_imu": "Fusion of the IMUs alone",
    "kinect_left": "Bridge of the left Kinect",
    "kinect_right": "Bridge of the right Kinect",
}
IMUS_ALIGNED = "imus_aligned"  # value of the fusion's report: segments, separated by commas


class LiveGraph:
    """Collects messages and returns snapshots for display.

    Args:
        bodies: Titles of the expected bodies, by id.
        sensors: Names of the cameras.
        span_s: Duration of the history [s].
    """

    def __init__(self, bodies: Mapping[str, str], sensors: Sequence[str], span_s: float) -> None:
        self._titles: dict[str, str] = {}
        self._expected = tuple(bodies)
        self._span_ns = round((span_s + 1.0) * NS_PER_S)
        self._tracks: dict[str, deque[BodySnapshot]] = {}
        self._dof: dict[str, DofSnapshot] = {}
        self._rotations: dict[str, dict[str, FloatArray]] = {}
        self._robot: RobotSnapshot | None = None
        self.robot_asked = JointHistory(self._span_ns)
        """History of the target angles of the robot's joints."""
        self.robot_joints = JointHistory(self._span_ns)
        """History of the robot's joint states."""
        self._raw: dict[str, tuple[int, tuple[SkeletonSample, ...]]] = {}
        self._static_transforms = StaticTransforms()
        self._sensors: dict[str, FloatArray] = {}
        self._reports: dict[str, NodeStatus] = {}
        self._body_watches: dict[str, TopicWatch] = {}
        self._sensor_watches = {sensor: TopicWatch(sensor, RATE_WINDOW_S) for sensor in sensors}
        self.counters = Counters("malformed_skeletons", "malformed_transforms", "late_skeletons")
        for body, title in bodies.items():
            self.add_body(body, title)

    @property
    def bodies(self) -> Iterable[str]:
        """Ids of all bodies."""
        return self._titles.keys()

    def add_body(self, body: str, title: str) -> None:
        """Add a body."""
        self._titles[body] = title
        self._tracks[body] = deque()
        self._body_watches[body] = TopicWatch(body, RATE_WINDOW_S)

    def remove_body(self, body: str) -> None:
        """Remove a body that is no longer published."""
        del self._titles[body], self._tracks[body], self._body_watches[body]
        self._dof.pop(body, None)
        self._rotations.pop(body, None)

    # -- messages in ----------------------------------------------------------------------------

    def note_skeleton(self, body: str, stamp_ns: int, now_ns: int) -> None:
        """Count the arrival of a body's skeleton, also if it is not shown."""
        self._body_watches[body].add(now_ns, stamp_ns)

    def note_raw(self, sensor: str, stamp_ns: int, now_ns: int) -> None:
        """Count the arrival of a camera's frame, also if it is not shown."""
        self._sensor_watches[sensor].add(now_ns, stamp_ns)

    def add_skeleton(self, body: str, message: Any) -> None:
        """Add a body's skeleton, after its estimate and links of the same instant."""
        try:
            shown = body_snapshot(message, self._dof.get(body), self._rotations.get(body))
        except InputError:
            self.counters.add("malformed_skeletons")
            return
        _, seen = self._raw.get(next(iter(self._sensor_watches), ""), (0, None))
        if seen is not None:
            shown = replace(shown, is_occluded=occluded_joints(seen, shown.stamp_ns))
        track = self._tracks[body]
        ahead_ns = track[-1].stamp_ns - shown.stamp_ns if track else 0
        if ahead_ns > RESTART_S * NS_PER_S:
            track.clear()  # a recording that restarts
        elif ahead_ns > 0:
            self.counters.add("late_skeletons")
            return
        track.append(shown)
        while shown.stamp_ns - track[0].stamp_ns > self._span_ns:
            track.popleft()

    def add_estimate(self, body: str, message: Any) -> None:
        """Add a body's degrees of freedom."""
        self._dof[body] = dof_snapshot(message)

    def add_tf(self, message: Any) -> None:
        """Add transforms of a body's or a robot's links."""
        places = robot_places(message)
        if places is not None and self._robot is not None:
            self._robot = replace(self._robot, position=places[0], wxyz=places[1])
        found = link_rotations(message)
        if found is not None:
            self._rotations[found[0]] = found[2]

    def add_robot(self, message: Any) -> None:
        """Add a robot's meshes."""
        self._robot = RobotSnapshot(shape=robot_shape(message), position={}, wxyz={})

    def add_static_tf(self, message: Any) -> None:
        """Add the sensors' poses."""
        try:
            self._sensors = self._static_transforms.add(message)
        except InputError:
            self.counters.add("malformed_transforms")

    def add_raw(self, sensor: str, message: Any, now_ns: int) -> None:
        """Add a camera's frame with all persons."""
        try:
            self._raw[sensor] = now_ns, tuple(skeleton_samples(message, sensor))
        except InputError:
            self.counters.add("malformed_skeletons")

    def add_report(self, report: NodeStatus) -> None:
        """Add a node's report in ``/diagnostics``, by the last part of its name."""
        self._reports[report.name.rpartition("/")[2]] = report

    # -- what to show ---------------------------------------------------------------------------

    def snapshot(self, now_ns: int) -> Snapshot:
        """The current snapshot."""
        tracks, raw = self._tracks.items(), self._raw.items()
        fusion = self._reports.get("fusion")
        aligned = fusion.values.get(IMUS_ALIGNED, "none") if fusion is not None else "none"
        return Snapshot(
            bodies={
                b: track[-1] for b, track in tracks if track and not self._is_silent(b, now_ns)
            },
            sensors=self._sensors,
            raw={s: seen for s, (at_ns, seen) in raw if now_ns - at_ns < HOLD_S * NS_PER_S},
            imus=() if aligned == "none" else tuple(aligned.split(", ")),
            robot=self._robot,
        )

    def _is_silent(self, body: str, now_ns: int) -> bool:
        """Whether a body's last pose is too old to be shown."""
        age_s = self._body_watches[body].status(now_ns).age_s
        return age_s is not None and age_s > HOLD_S

    def track(self, body: str, start_s: float, end_s: float) -> BodyTrack:
        """History of a body between two times of the clock [s]."""
        first, last = start_s * NS_PER_S, end_s * NS_PER_S
        return track_of([s for s in self._tracks.get(body, ()) if first <= s.stamp_ns <= last])

    def robot_tracks(self) -> tuple[JointTrack, JointTrack] | None:
        """History of the robot's target angles and of its measured ones; None without a robot."""
        asked, measured = self.robot_asked.track(), self.robot_joints.track()
        return (asked, measured) if asked.joints and measured.joints else None

    def persons(self) -> tuple[str, ...]:
        """The ids of all persons in the cameras' frames."""
        return tuple(sorted({s.person for _, seen in self._raw.values() for s in seen}))

    def bag(self) -> str | None:
        """Path of the bag being recorded: empty if there is none, None without a recorder."""
        recorder = self._reports.get("recorder")
        return None if recorder is None else recorder.values.get("bag", "")

    def lines(self, now_ns: int) -> Iterable[StatusLine]:
        """Status lines."""
        for sensor, watch in self._sensor_watches.items():
            yield stream_line(f"Kinect {sensor}", watch.status(now_ns))
        yield imu_line(self._reports.get("imu_bridge"), now_ns)
        for name, title in (("calibration", "Calibration"), ("fusion", "Fusion")):
            yield node_line(title, self._reports.get(name), now_ns)
        for body, watch in self._body_watches.items():
            if body not in self._expected and self._is_silent(body, now_ns):
                continue  # a person who has left
            dof = self._dof.get(body)
            delay_s = None if dof is None else dof.latency_s
            yield stream_line(self._titles[body], watch.status(now_ns), delay_s)
        yield node_line("Recorder", self._reports.get("recorder"), now_ns)
        for name, report in sorted(self._reports.items()):
            if report.level and name not in ("imu_bridge", "calibration", "fusion", "recorder"):
                yield node_line(OTHER_NODES.get(name, name), report, now_ns)
