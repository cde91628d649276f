"""The fusion node: skeletons and IMUs in, the pose of one person or several out."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import TransformStamped
from pose_msgs.msg import SkeletonArray
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, TimeReference
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from pose_calibration.files.extrinsics_file import load_extrinsics_of
from pose_calibration.imus.section import load_alignments_if_any
from pose_core.api import (
    BodyShape,
    EstimateBlock,
    Extrinsics,
    FusionParameters,
    PeoplePipeline,
    SkeletonSample,
    StampJudge,
    estimator_class,
    extrinsics_from_map,
    has_output_rate,
    load_body_shape,
    make_urdf,
    save_body_shape,
    warm_up,
)
from pose_core.counters import Counters
from pose_core.errors import InputError, ParameterError
from pose_core.joints import SEGMENTS
from pose_core.stamps import NS_PER_S
from pose_fusion.conversions import body_topics, to_string, urdf_topic
from pose_fusion.estimate_bytes import EstimateBytes
from pose_fusion.nodes.inbox import Inbox, waiting
from pose_fusion.nodes.qos import latched
from pose_fusion.unused_sensors import unused_sensors
from pose_fusion.watching.stages import LatencyStages
from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.skeleton_bytes import SkeletonReader
from pose_io.clock_messages import clock_of
from pose_io.preparing import prepare_reading
from pose_io.static_transforms import transforms_to_map
from pose_io.typestore import make_typestore
from pose_node.kept import KeptPerson, kept_file
from pose_node.level import Level
from pose_node.nodes.diagnostics import Report
from pose_node.nodes.managed import ManagedNode
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer

QUEUE = 50  # [messages] a burst after a pause of the process is not lost
SENSOR_QOS = QoSProfile(depth=QUEUE, reliability=ReliabilityPolicy.BEST_EFFORT)
IMU_QUEUE = 200  # [messages] of each IMU
IMU_QOS = QoSProfile(depth=IMU_QUEUE, reliability=ReliabilityPolicy.BEST_EFFORT)
IMU_PERIOD_S = 0.01  # [s] after which IMUs' samples are taken: few wait when a frame comes
PATIENCE_S = 0.01  # [s] for which a frame waits for another sensor's of before it
LATCHED_QOS = latched(QUEUE)


class FusionNode(ManagedNode[FusionParameters]):
    """Feeds a :class:`PeoplePipeline` and publishes what it says.

    Args:
        **options: Of :class:`rclpy.node.Node`.
    """

    def __init__(self, **options: Any) -> None:
        self._body_publishers: dict[str, dict[str, Publisher]] = {}  # by body and topic
        super().__init__("fusion", FusionParameters, **options)

    def configure(self) -> None:
        """Make the pipeline, load what is known of cameras, person and IMUs."""
        if estimator_class(self.settings.estimator).NEEDS_FUTURE:
            raise ParameterError(
                f"estimator = {self.settings.estimator} looks ahead, which a live node cannot: "
                "choose another, or use ./pose fuse on a bag"
            )
        kept = kept_file(self.get_fully_qualified_name(), self.settings.run)
        self._shape_path = Path(self.settings.shape_file) if self.settings.shape_file else kept
        self._kept_person = KeptPerson(kept)
        self._counters = Counters(
            "malformed_skeletons",
            "joints_not_tracked",
            "imu_without_orientation",
            "malformed_transforms",
        )
        self._static_transforms: dict[str, TransformStamped] = {}
        self._malformed_transform = ""  # of the last message on /tf_static, if it was not used
        self._announced_shapes: dict[str, BodyShape] = {}  # by body
        self._typestore = make_typestore()
        self._bytes: dict[str, EstimateBytes] = {}  # by body
        self._latency_s = 0.0
        self._make_pipeline()
        self.changes["person"] = lambda person: self.pipeline.follow(person)
        prepare_reading()
        self._bytes_of(self.settings.subject)
        self._open_body(self.settings.subject)
        self._load_files()

    def activate(self) -> None:
        """Listen to cameras and IMUs, publish."""
        self._cameras: dict[str, Subscription] = {}
        self._readers = {sensor: SkeletonReader(sensor) for sensor in self.settings.sensors}
        segments = SEGMENTS if self.settings.use_imus else ()
        topics = {segment: f"imu_{segment}/data" for segment in segments}
        self._imus = Inbox(self, Imu, topics, IMU_QOS)
        if topics:
            steady_timer(self, IMU_PERIOD_S, self._take_imus)  # cameras may be silent
        self._patience = steady_timer(self, PATIENCE_S, self._on_patience_ended)
        self._patience.cancel()
        if has_output_rate(self.settings):
            steady_timer(self, 1.0 / self.settings.output_rate, self._publish_now)
        self._subscribe()

    def deactivate(self) -> None:
        """Cameras' places, the person's body and the IMUs' alignment stay."""

    def cleanup(self) -> None:
        """They go with the next pipeline; of the publishers, those of people who came later."""
        for publishers in self._body_publishers.values():
            for publisher in publishers.values():
                self.destroy_publisher(publisher)
        self._body_publishers.clear()

    def restart_time(self) -> None:
        """Begin anew, of the same person before the same cameras: stamps come again."""
        before = self.pipeline
        self._make_pipeline()
        if before.subject.extrinsics is not None:
            self.pipeline.place_sensors(before.subject.extrinsics)
        shape = before.shape_of(self.settings.subject)
        if shape is not None:
            self.pipeline.use_shape(shape)
        self.pipeline.use_sensor_to_segment(self._mountings)

    def _make_pipeline(self) -> None:
        self.pipeline = PeoplePipeline(self.settings, self._send, is_live=True)
        self._judge = StampJudge() if has_output_rate(self.settings) else None
        self._stages = LatencyStages()  # of the reference sensor's frames
        self._reported_estimates = 0

    def _bytes_of(self, body_id: str) -> EstimateBytes:
        """What makes a body's messages, used once: nothing is compiled at the first publication."""
        if body_id not in self._bytes:
            example = warm_up(self.settings.estimator, self.pipeline.model)
            model, typestore = self.pipeline.model, self._typestore
            self._bytes[body_id] = made = EstimateBytes(model, body_id, typestore, example[0])
            for _ in made.write(example, np.zeros(len(example))):
                pass
        return self._bytes[body_id]

    def _load_files(self) -> None:
        parameters, pipeline = self.settings, self.pipeline
        chosen = self._kept_person.load()
        if chosen:
            pipeline.follow(chosen)
        if parameters.extrinsics_file:
            path = Path(parameters.extrinsics_file)
            pipeline.place_sensors(load_extrinsics_of(path, parameters.sensors))
        if self._shape_path is not None and self._shape_path.exists():
            pipeline.use_shape(load_body_shape(self._shape_path, pipeline.model))
            self._announce_shape()
        name, mountings = load_alignments_if_any(parameters.imus_file, parameters.extrinsics_file)
        self._mountings = mountings
        pipeline.use_sensor_to_segment(mountings)
        if mountings or parameters.imus_file:
            known = ", ".join(mountings) or "none: each is aligned from motion"
            self.get_logger().info(f"IMUs whose mounting {name} tells: {known}")

    def _follow(self, person: str) -> None:
        """Follow this person from now on, also after a death of this node."""
        self.pipeline.follow(person)
        self._kept_person.save(person)

    def _subscribe(self) -> None:
        for sensor in self.settings.sensors:
            self._cameras[sensor] = self.create_subscription(
                SkeletonArray,
                f"kinect_{sensor}/skeletons",
                partial(self._on_skeletons, sensor),
                SENSOR_QOS,
                raw=True,
            )
        if not self.settings.extrinsics_file:
            self.create_subscription(TFMessage, "tf_static", self._on_tf_static, LATCHED_QOS)
        self.create_subscription(TimeReference, "clock_offsets", self._on_clock, LATCHED_QOS)

    def _on_skeletons(self, sensor: str, data: bytes, info: dict[str, Any]) -> None:
        taken_ns = self.get_clock().now().nanoseconds
        # What the IMUs have sent until now is known first.
        self._take_imus()
        # Sensors of one phase deliver together: to be woken for each costs more than to look.
        frames = [(sensor, data, info)]
        for other, subscription in self._cameras.items():
            frames += [(other, more, noted) for more, noted in waiting(subscription)]
        seen = [persons for frame in frames for persons in self._persons_of(*frame, taken_ns)]
        # After a pause each queue holds many: in the order of their stamps, not camera by camera.
        for persons in sorted(seen, key=lambda persons: persons[0].stamp_ns if persons else 0):
            self.pipeline.add_frame(persons)
        if self.pipeline.holds_frames:
            self._patience.reset()
        self._learn()

    def _persons_of(
        self, sensor: str, data: bytes, info: dict[str, Any], taken_ns: int
    ) -> list[tuple[SkeletonSample, ...]]:
        """Everybody in a camera's message; of a message that cannot be used, no frame."""
        (persons,) = self._readers[sensor].read([data])
        if isinstance(persons, InputError):
            self._counters.add("malformed_skeletons")
            self.get_logger().warning(str(persons), throttle_duration_sec=5.0)
            return []
        for person in persons:
            missing = len(person.tracking_state) - int(np.count_nonzero(person.tracking_state))
            self._counters.add("joints_not_tracked", missing)
        if persons and self._judge is not None:
            arrival_ns = self._time_of(info, "received_timestamp", taken_ns)
            judged = self._judge.skeleton(persons[0], arrival_ns, self.pipeline.clocks)
            if judged is None:
                return []
            persons = [replace(person, stamp_ns=judged.stamp_ns) for person in persons]
        if persons and sensor == self.settings.sensors[0]:
            published_ns = self._time_of(info, "source_timestamp", taken_ns)
            self._stages.note_taken(persons[0].stamp_ns, published_ns, taken_ns)
        return [tuple(persons)]

    def _time_of(self, info: dict[str, Any], what: str, taken_ns: int) -> int:
        """A time that the middleware notes [ns]; by simulated time, when it was taken."""
        is_known = not self.get_clock().ros_time_is_active and info.get(what, 0) > 0
        return int(info[what]) if is_known else taken_ns

    def _on_patience_ended(self) -> None:
        self._patience.cancel()
        self._take_imus()
        self.pipeline.wait_no_longer()
        self._learn()

    def _take_imus(self) -> None:
        datas = self._imus.take()
        if datas:
            block, _ = imu_block(datas)
            count = sum(map(len, datas.values()))
            self._counters.add("imu_without_orientation", count - len(block))
            if self._judge is not None:
                now_ns = self.get_clock().now().nanoseconds
                block = self._judge.imus(block, now_ns, self.pipeline.clocks)
            if len(block):
                self.pipeline.add_imu(block.rows(np.argsort(block.stamps_ns)))

    def _on_tf_static(self, message: TFMessage) -> None:
        transforms = {t.child_frame_id: t for t in message.transforms}
        transforms = {**self._static_transforms, **transforms}
        try:
            placed = transforms_to_map(transforms.values())
        except InputError as error:
            # The cameras stay where they were.
            self._counters.add("malformed_transforms")
            self._malformed_transform = str(error)
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        self._static_transforms, self._malformed_transform = transforms, ""
        if all(sensor in placed for sensor in self.settings.sensors):
            extrinsics: Extrinsics = extrinsics_from_map(
                {sensor: placed[sensor] for sensor in self.settings.sensors}
            )
            self.pipeline.place_sensors(replace(extrinsics, clocks=dict(self.pipeline.clocks)))

    def _on_clock(self, message: TimeReference) -> None:
        self.pipeline.use_clocks({**self.pipeline.clocks, message.source: clock_of(message)})

    def _publish_now(self) -> None:
        self._take_imus()
        self.pipeline.publish_until(self.get_clock().now().nanoseconds)

    def _learn(self) -> None:
        """What may wait until the estimate has gone out."""
        self.pipeline.calibrate_session()
        self._announce_shape()

    def _open_body(self, body_id: str) -> dict[str, Publisher]:
        """The publishers of a body, made when it is first spoken of."""
        opened = self._body_publishers.get(body_id)
        if opened is None:
            types = {urdf_topic(body_id): String, **body_topics(body_id)}
            opened = {
                topic: self.create_publisher(
                    # Relative: in a namespace, all of a graph is in it.
                    each,
                    topic.lstrip("/"),
                    LATCHED_QOS if topic == urdf_topic(body_id) else 10,
                )
                for topic, each in types.items()
            }
            self._body_publishers[body_id] = opened
        return opened

    def _send(self, body_id: str, estimates: EstimateBlock) -> None:
        now_ns = self.get_clock().now().nanoseconds
        # Clocks are put right to within some milliseconds: a sample may seem to be of later.
        latencies_s = np.maximum(now_ns - estimates.newest_ns, 0) / NS_PER_S
        publishers = self._open_body(body_id)
        for topic, rows in self._bytes_of(body_id).write(estimates, latencies_s):
            for data in rows:
                publishers[topic].publish(data.tobytes())
        if body_id == self.settings.subject:
            self._latency_s = float(latencies_s[-1])
            self._stages.note_output(self.get_clock().now().nanoseconds)

    def _announce_shape(self) -> None:
        """Publish each person's tree, and save the subject's measures, once they are known."""
        for body_id in {self.settings.subject, *self.pipeline.people}:
            shape = self.pipeline.shape_of(body_id)
            if shape is None or shape is self._announced_shapes.get(body_id):
                continue
            self._announced_shapes[body_id] = shape
            urdf = make_urdf(self.pipeline.model, shape, body_id)
            self._open_body(body_id)[urdf_topic(body_id)].publish(to_string(urdf))
            if body_id == self.settings.subject:
                self._save_shape(shape)

    def _save_shape(self, shape: BodyShape) -> None:
        path = self._shape_path
        if path is not None and not path.exists():
            try:
                save_body_shape(path, self.pipeline.model, shape, self.settings.subject)
            except InputError as error:
                self.get_logger().error(str(error))

    def report(self) -> Report:
        """Whether the person is tracked, from what, and how late."""
        counts = self.pipeline.counters.as_dict()
        estimates = counts["estimates"]
        is_tracking = estimates > self._reported_estimates
        self._reported_estimates = estimates
        message = self.pipeline.status
        if message == "tracking" and not is_tracking:
            message = "no skeletons: the sensors see nobody, or are silent"
        imus, uses = self.pipeline.subject.imus, self.pipeline.imu_uses
        idle = [use for use in uses if use.reason]
        if is_tracking and idle:
            message = f"tracking without the IMU on {idle[0]}"
            if len(idle) > 1:
                message += f"; {len(idle) - 1} more, see the values"
        silent = self.pipeline.subject.silent_imus if self.settings.use_imus else ()
        if silent:
            message += (
                f"; no samples from the IMU on {', '.join(silent)}: check its battery and radio"
            )
        unused = self._unused_sensors()
        set_aside = self._judge.set_aside if self._judge is not None else {}
        for source, reason in set_aside.items():
            message += f"; {source} is set aside: its {reason}"
        if self._malformed_transform:
            message += f"; /tf_static is not used: {self._malformed_transform}"
        if self.pipeline.others:
            message += f"; {self.pipeline.others} more people in sight, not followed"
        if unused:
            message += f"; not used: {', '.join(unused)}, add it to sensors"
        return Report(
            level=Level.OK
            if is_tracking and not (idle or silent or set_aside or self._malformed_transform)
            else Level.WARN,
            message=message,
            values={
                "estimator": self.settings.estimator,
                "sensors": ", ".join(self.settings.sensors),
                "sensors_not_used": ", ".join(unused) or "none",
                "latency_s": f"{self._latency_s:.4f}",
                **self._stages.as_dict(),
                **{
                    f"clock_ahead_ms/{source}": f"{clock.ahead_ns(clock.at_ns) * 1e-6:.1f}"
                    for source, clock in self.pipeline.clocks.items()
                },
                "imus": ", ".join(imus.segments) or "none",
                "imus_aligned": ", ".join(u.segment for u in uses if u.is_aligned) or "none",
                **{f"imu/{use.segment}": str(use) for use in uses},
                **counts,
                **imus.counters.as_dict(),
                **self._counters.as_dict(),
                **self._clock_values(set_aside),
                "people": ", ".join(self.pipeline.people) or "none",
                "people_not_followed": self.pipeline.others,
                **{f"people/{name}": n for name, n in self.pipeline.people_counts.items()},
                **self.pipeline.subject.aligner.counters.as_dict("alignment/"),
            },
        )

    def _clock_values(self, set_aside: Mapping[str, str]) -> dict[str, str | int]:
        """What has become of the sources' stamps."""
        if self._judge is None:
            return {}
        leapt = self._judge.offsets_s.items()
        return {
            "sources_set_aside": "; ".join(f"{s}: {r}" for s, r in set_aside.items()) or "none",
            **{f"clock_leapt_s/{source}": f"{-offset_s:.3f}" for source, offset_s in leapt},
            **self._judge.counters.as_dict(),
        }

    def _unused_sensors(self) -> tuple[str, ...]:
        """Cameras that publish and are not used; the graph lists what we subscribe to as well."""
        topics = self.get_topic_names_and_types()
        return unused_sensors(topics, self.settings.sensors, self.get_namespace())


def main() -> None:
    """Run the node."""
    run_node(FusionNode, parameters=FusionParameters)
