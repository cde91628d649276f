"""The fusion node: estimates the poses of one or several people from skeletons and IMUs."""

import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from pose_msgs.msg import SkeletonArray
from sensor_msgs.msg import Imu, TimeReference
from tf2_msgs.msg import TFMessage

from pose_calibration.files.extrinsics_file import load_extrinsics_of
from pose_calibration.imus.section import load_alignments_if_any
from pose_core.api import (
    EstimateBlock,
    PeoplePipeline,
    SensorFrame,
    StampCheck,
    estimator_class,
    has_output_rate,
    warm_up,
)
from pose_core.counters import Counters
from pose_core.errors import InputError, ParameterError
from pose_core.joints import SEGMENTS
from pose_fusion.kept_session import KeptSession
from pose_fusion.nodes.body_publishers import BodyPublishers
from pose_fusion.nodes.fusion_report import FusionReporter
from pose_fusion.nodes.inbox import Inbox, MessageInfo, MessageQueue
from pose_fusion.nodes.simulated_time import SimulatedTime
from pose_fusion.nodes.standstill import Standstill
from pose_fusion.parameters import FusionNodeParameters
from pose_fusion.sample_reader import COUNTS, MessageTimes, SampleReader
from pose_io.clock_messages import clock_of
from pose_io.names import BODIES, imu_topic, skeletons_topic
from pose_io.preparing import prepare_reading
from pose_io.static_transforms import StaticTransforms
from pose_io.topics import IMU, misnamed_imu_topics, unused_sensors
from pose_node.node_status import Level, Report
from pose_node.nodes.managed import ManagedNode
from pose_node.nodes.qos import latched, sensor_data
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer

QUEUE = 50  # [messages] enough for a burst after a pause of the process
SENSOR_QOS = sensor_data(QUEUE)
IMU_QOS = sensor_data(200)  # [messages] of each IMU
IMU_PERIOD_S = 0.01  # [s] between reads of IMU samples, so that few wait when a frame arrives
REORDER_TIMEOUT_S = 0.01  # [s] for which a frame waits for an earlier one of another sensor
CHECK_PERIOD_S = 0.2  # [s] between checks of the sources
KEEP_PERIOD_S = 1.0  # [s] between saves of IMU alignments and closings of topics
LOG_PERIOD_S = 2.0  # [s] between lines of the log about sources
KILLED_REPORTS = 25  # of 1 s; the middleware counts a killed process's publishers for 20 s
LATCHED_QOS = latched(QUEUE)


class FusionNode(ManagedNode[FusionNodeParameters]):
    """Passes samples to a :class:`PeoplePipeline` and publishes its estimates."""

    def __init__(self, **options: Any) -> None:
        super().__init__("fusion", FusionNodeParameters, **options)

    def configure(self) -> None:
        """Create the pipeline; load extrinsics, body shape and IMU alignments."""
        if estimator_class(self.settings.estimator).NEEDS_FUTURE:
            raise ParameterError(
                f"estimator = {self.settings.estimator} needs later samples, which a live node "
                "does not have: choose another, or use ./pose fuse on a bag"
            )
        self._kept = KeptSession(self.get_fully_qualified_name(), self.settings)
        self._counters = Counters(
            *COUNTS, "malformed_transforms", "malformed_clocks", "messages_lost"
        )
        self._static_transforms = StaticTransforms()
        self._shared: dict[str, int] = {}
        """Number of reports in a row in which a topic had several publishers."""
        # Unusable sources, or what it waited for, and when that was logged [s].
        self._logged: tuple[frozenset[str] | None, float] = None, time.monotonic()
        self._simulated_time = SimulatedTime(self.get_clock())
        self._malformed: dict[str, str] = {}  # why the last message of a topic was rejected
        self._subscribe_to_sensors()  # they find this node while the kernels are loaded
        self._make_pipeline()
        self.changes["person"] = self._choose
        prepare_reading()
        model = self.pipeline.subject.model
        self._bodies = BodyPublishers(self, model, warm_up(self.settings.estimator, model))
        self._bodies.open(self.settings.subject)
        self._load_files()

    def activate(self) -> None:
        """Process what cameras and IMUs send from now on, publish."""
        self._imus.take()
        for queue in self._cameras.values():
            queue.take()
        self._take_lost()  # before: nobody waited for them
        if self.settings.use_imus:
            steady_timer(self, IMU_PERIOD_S, self._take_imus)  # cameras may be silent
        self._reorder_timer = steady_timer(self, REORDER_TIMEOUT_S, self._release_held)
        self._reorder_timer.cancel()
        if has_output_rate(self.settings):
            steady_timer(self, 1.0 / self.settings.output_rate, self._publish_now)
        self._standstill = Standstill({**self._cameras, **self._imus.queues})
        steady_timer(self, CHECK_PERIOD_S, self._check_sources)
        steady_timer(self, KEEP_PERIOD_S, self.keep_alignments)
        steady_timer(self, KEEP_PERIOD_S, lambda: self._bodies.keep(self.pipeline.remembered))
        if not self.settings.extrinsics_file:
            self.create_subscription(TFMessage, "tf_static", self._on_tf_static, LATCHED_QOS)
        self.create_subscription(TimeReference, "clock_offsets", self._on_clock, LATCHED_QOS)

    def cleanup(self) -> None:
        """Also destroy the publishers of people who appeared after configuring."""
        if hasattr(self, "_bodies"):  # configuring may have failed before
            self._bodies.keep(())

    def restart_time(self) -> None:
        """Restart with the same person and the same cameras: stamps will be repeated."""
        before = self.pipeline
        self._make_pipeline()
        if before.subject.extrinsics is not None:
            self.pipeline.use_extrinsics(before.subject.extrinsics)
        shape = before.shape_of(self.settings.subject)
        if shape is not None:
            self.pipeline.use_shape(shape)
        self.pipeline.use_sensor_to_segment(self._kept.alignments)

    def _make_pipeline(self) -> None:
        parameters = replace(self.settings, person=self._kept.person)
        self.pipeline = PeoplePipeline(parameters, self._publish, is_live=True)
        check = StampCheck() if has_output_rate(self.settings) else None
        self._reader = SampleReader(self.settings.sensors, check, self._counters)
        self._reporter = FusionReporter(self.pipeline, self._reader)

    def _load_files(self) -> None:
        parameters, pipeline = self.settings, self.pipeline
        if parameters.extrinsics_file:
            path = Path(parameters.extrinsics_file)
            pipeline.use_extrinsics(load_extrinsics_of(path, parameters.sensors))
        shape = self._kept.load_shape(pipeline.subject.model)
        if shape is not None:
            pipeline.use_shape(shape)
            self._publish_shapes()
        name, alignments = load_alignments_if_any(parameters.imus_file, parameters.extrinsics_file)
        self._kept.load_alignments(alignments)
        pipeline.use_sensor_to_segment(self._kept.alignments)
        if alignments or parameters.imus_file:
            known = ", ".join(alignments) or "none: each is aligned from motion"
            self.get_logger().info(f"IMUs whose alignment is from {name}: {known}")

    def _choose(self, person: str) -> None:
        """Choose the subject by a new rule from now on, also after a restart of this node."""
        self.pipeline.choice.choose_by(person)
        self._kept.choose(person)

    def _subscribe_to_sensors(self) -> None:
        self._cameras = {}
        for sensor in self.settings.sensors:
            topic, callback = skeletons_topic(sensor), partial(self._on_skeletons, sensor)
            subscription = self.create_subscription(
                SkeletonArray, topic, callback, SENSOR_QOS, raw=True
            )
            self._cameras[sensor] = MessageQueue(subscription)
        segments = SEGMENTS if self.settings.use_imus else ()
        topics = {segment: imu_topic(segment) for segment in segments}
        self._imus = Inbox(self, Imu, topics, IMU_QOS)

    def _on_skeletons(self, sensor: str, data: bytes, info: MessageInfo) -> None:
        self._cameras[sensor].note(info)
        if not self.is_active:
            return
        taken_ns = self.get_clock().now().nanoseconds
        self._take_imus()  # process the samples before this frame first
        # Sensors with the same phase deliver together: reading all saves wake-ups.
        received = [(sensor, data, info)]
        for other, queue in self._cameras.items():
            received += [(other, *entry) for entry in queue.take()]
        read = (self._read_frame(*entry, taken_ns) for entry in received)
        frames = [frame for frame in read if frame is not None]
        # After a pause each queue holds many frames: process them in the order of their stamps.
        for frame in sorted(frames, key=lambda frame: frame[0].stamp_ns if frame else 0):
            self.pipeline.add(frame)
        if self.pipeline.holds_frames:
            self._reorder_timer.reset()
        self._publish_shapes()

    def _read_frame(
        self, sensor: str, data: bytes, info: MessageInfo, taken_ns: int
    ) -> SensorFrame | None:
        """The people in a camera's message; None if it is not to be used."""
        known = {} if self.get_clock().ros_time_is_active else info  # on the host's clock
        times = MessageTimes(
            published_ns=known.get("source_timestamp", 0) or taken_ns,
            received_ns=known.get("received_timestamp", 0) or taken_ns,
            taken_ns=taken_ns,
        )
        try:
            return self._reader.frame(sensor, data, times, self.pipeline.clocks)
        except InputError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return None

    def _release_held(self) -> None:
        self._reorder_timer.cancel()
        self._take_imus()
        self.pipeline.release_held()
        self._publish_shapes()

    def _take_imus(self) -> None:
        clock = self.get_clock()
        now_ns = clock.now().nanoseconds
        datas, received_ns = self._imus.take_received(now_ns)
        if datas:
            arrivals_ns = now_ns if clock.ros_time_is_active else received_ns
            block = self._reader.imus(datas, arrivals_ns, self.pipeline.clocks)
            if len(block):
                self.pipeline.add(block)

    def _on_tf_static(self, message: TFMessage) -> None:
        with self._rejecting("/tf_static", "malformed_transforms"):
            extrinsics = self._static_transforms.extrinsics(message, self.settings.sensors)
            if extrinsics is not None:
                self.pipeline.use_extrinsics(replace(extrinsics, clocks=dict(self.pipeline.clocks)))

    def _on_clock(self, message: TimeReference) -> None:
        with self._rejecting(f"clock_offsets/{message.source}", "malformed_clocks"):
            clock = clock_of(message)
            self.pipeline.use_clocks({**self.pipeline.clocks, message.source: clock})

    @contextmanager
    def _rejecting(self, topic: str, counter: str) -> Iterator[None]:
        """Count and report an InputError about a topic's message; a valid one ends the report."""
        try:
            yield
            self._malformed.pop(topic, None)
        except InputError as error:
            self._counters.add(counter)
            self._malformed[topic] = str(error)
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)

    def _publish_now(self) -> None:
        self._take_imus()
        self.pipeline.publish_until(self.get_clock().now().nanoseconds)

    def _publish(self, body_id: str, estimates: EstimateBlock) -> None:
        latency_s = self._bodies.publish(body_id, estimates)
        if body_id == self.settings.subject:
            self._reporter.latency_s = latency_s
            self._reader.stages.note_output(self.get_clock().now().nanoseconds)

    def _publish_shapes(self) -> None:
        """Publish each person's kinematic tree and save the subject's shape, once known."""
        for body_id in {self.settings.subject, *self.pipeline.people}:
            shape = self.pipeline.shape_of(body_id)
            if shape is None or not self._bodies.publish_shape(body_id, shape):
                continue
            if body_id == self.settings.subject:
                try:
                    self._kept.save_shape(self.pipeline.subject.model, shape)
                except InputError as error:
                    self.get_logger().error(str(error))

    def _check_sources(self) -> None:
        """Report immediately which sources have become unusable or usable; end if deaf."""
        self._standstill.check()
        if self._reporter.check():
            self.diagnostics.publish()

    def keep_alignments(self) -> None:
        """Save the IMUs' alignments."""
        self._kept.save_alignments(self.pipeline.subject)

    def _take_lost(self) -> dict[str, int]:
        """Messages lost since the last call, by source."""
        cameras = {sensor: queue.take_lost() for sensor, queue in self._cameras.items()}
        imus = {f"imu/{segment}": lost for segment, lost in self._imus.take_lost().items()}
        return {name: lost for name, lost in {**cameras, **imus}.items() if lost}

    def report(self) -> Report:
        """State of the tracking, sensors in use, and latency."""
        lost = self._take_lost()
        self._counters.add("messages_lost", sum(lost.values()))
        topics = self.get_topic_names_and_types()
        unused = unused_sensors(topics, self.settings.sensors, self.get_namespace())
        report = self._reporter.report(
            unused,
            self._malformed,
            lost,
            self._several_publishers(),
            self._simulated_time.trouble,
            self._imus.unheard,
            self._unread_imus(topics),
        )
        self._log_change(report)
        return report

    def _unread_imus(self, topics: Iterable[tuple[str, Collection[str]]]) -> dict[str, str]:
        """IMUs that somebody publishes and this node does not read, and why."""
        if not self.settings.use_imus:
            names = {segment: self.resolve_topic_name(imu_topic(segment)) for segment in SEGMENTS}
            sending = [segment for segment, name in names.items() if self.count_publishers(name)]
            return dict.fromkeys(sending, "use_imus is false")
        prefix = f"{self.get_namespace().rstrip('/')}/"
        imus = [t for t, types in topics if IMU in types and t.startswith(prefix)]
        misnamed = misnamed_imu_topics(list(filter(self.count_publishers, imus)), SEGMENTS)
        read = {each.subscription.topic_name for each in self._imus.queues.values()}  # or remapped
        expected = "expected imu_<segment>/data, for example imu_left_thigh/data"
        return {topic: expected for topic in misnamed if topic not in read}

    def _log_change(self, report: Report) -> None:
        """Log what the node waits for, or that other sources are unusable than logged last."""
        status, now_s = self.pipeline.status, time.monotonic()
        is_waiting = status != "tracking"
        trouble = frozenset({status}) if is_waiting else self._reporter.trouble
        if trouble != self._logged[0] and now_s - self._logged[1] >= LOG_PERIOD_S:
            self._logged = trouble, now_s
            if is_waiting or report.level is Level.OK:  # rclpy wants one severity at each call
                self.get_logger().info(report.message)
            else:
                self.get_logger().warning(report.message)

    def _several_publishers(self) -> dict[str, int]:
        """Number of publishers of each topic that should have one and has several."""
        topics = [f"{BODIES}{self.settings.subject}/joint_states".lstrip("/")]
        topics += map(skeletons_topic, self.settings.sensors)
        topics += map(imu_topic, self._imus.queues)
        counts = {each: self.count_publishers(self.resolve_topic_name(each)) for each in topics}
        self._shared = {t: self._shared.get(t, 0) + 1 for t, count in counts.items() if count > 1}
        return {topic: counts[topic] for topic, n in self._shared.items() if n > KILLED_REPORTS}


def main() -> None:
    """Run the node."""
    run_node(FusionNode, parameters=FusionNodeParameters)
