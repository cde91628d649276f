"""The fusion node: skeletons and IMUs in, one person's pose out."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import TransformStamped
from pose_msgs.msg import SkeletonArray
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu, TimeReference
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from pose_calibration.files.extrinsics_file import load_extrinsics_of
from pose_calibration.imus.section import load_mountings_if_any
from pose_core.api import (
    BodyShape,
    EstimateBlock,
    Extrinsics,
    FusionParameters,
    FusionPipeline,
    PersonSelector,
    estimator_class,
    extrinsics_from_map,
    load_body_shape,
    make_urdf,
    save_body_shape,
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
from pose_node.level import Level
from pose_node.nodes.declaring import accept_changes, declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher, Report
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer

QUEUE = 50  # [messages] a burst after a pause of the process is not lost
SENSOR_QOS = QoSProfile(depth=QUEUE, reliability=ReliabilityPolicy.BEST_EFFORT)
IMU_QUEUE = 200  # [messages] of each IMU
IMU_QOS = QoSProfile(depth=IMU_QUEUE, reliability=ReliabilityPolicy.BEST_EFFORT)
IMU_PERIOD_S = 0.01  # [s] after which IMUs' samples are taken: few wait when a frame comes
PATIENCE_S = 0.01  # [s] for which a frame waits for another sensor's of before it
LATCHED_QOS = latched(QUEUE)


class FusionNode(Node):
    """Feeds a :class:`FusionPipeline` and publishes what it says.

    Args:
        options: Of :class:`rclpy.node.Node`.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("fusion", **options)
        self._settings = declare_parameters(self, FusionParameters, changeable=("person",))
        self._body_id = self._settings.subject
        if estimator_class(self._settings.estimator).NEEDS_FUTURE:
            raise ParameterError(
                f"estimator = {self._settings.estimator} looks ahead, which a live node cannot: "
                "choose another, or use ./pose fuse on a bag"
            )
        can_predict = estimator_class(self._settings.estimator).CAN_PREDICT
        if self._settings.output_rate > 0.0 and not can_predict:
            raise ParameterError(
                f"estimator = {self._settings.estimator} cannot predict: choose default or imu, or "
                "leave output_rate at 0"
            )
        self.pipeline = FusionPipeline(self._settings)
        prepare_reading()
        if self._settings.output_rate == 0.0:
            self.pipeline.outlet = self._send
        self._selector = PersonSelector(self._settings.person)
        accept_changes(self, FusionParameters, {"person": self._selector.follow})
        self._counters = Counters(
            "malformed_skeletons",
            "joints_not_tracked",
            "imu_without_orientation",
            "malformed_transforms",
        )
        self._static_transforms: dict[str, TransformStamped] = {}
        self._announced_shape: BodyShape | None = None
        self._typestore = make_typestore()
        self._bytes: EstimateBytes | None = None
        self._reported_estimates = 0
        self._latency_s = 0.0
        self._stages = LatencyStages()  # of the reference sensor's frames
        self._urdf_publisher = self.create_publisher(String, urdf_topic(self._body_id), LATCHED_QOS)
        self._publishers_by_topic = {
            topic: self.create_publisher(message_type, topic, 10)
            for topic, message_type in body_topics(self._body_id).items()
        }
        self._cameras: dict[str, Subscription] = {}
        self._readers = {sensor: SkeletonReader(sensor) for sensor in self._settings.sensors}
        segments = SEGMENTS if self._settings.use_imus else ()
        topics = {segment: f"imu_{segment}/data" for segment in segments}
        self._imus = Inbox(self, Imu, topics, IMU_QOS)
        if topics:
            steady_timer(self, IMU_PERIOD_S, self._take_imus)  # cameras may be silent
        self._patience = steady_timer(self, PATIENCE_S, self._on_patience_ended)
        self._patience.cancel()
        if self._settings.output_rate > 0.0:
            self.create_timer(1.0 / self._settings.output_rate, self._publish_prediction)
        self._load_files()
        self._subscribe()
        self._diagnostics = DiagnosticsPublisher(self, self._report)

    def _load_files(self) -> None:
        parameters, pipeline = self._settings, self.pipeline
        if parameters.extrinsics_file:
            path = Path(parameters.extrinsics_file)
            pipeline.place_sensors(load_extrinsics_of(path, parameters.sensors))
        if parameters.shape_file and Path(parameters.shape_file).exists():
            pipeline.use_shape(load_body_shape(Path(parameters.shape_file), pipeline.model))
            self._announce_shape()
        name, mountings = load_mountings_if_any(parameters.imus_file, parameters.extrinsics_file)
        pipeline.use_mountings(mountings)
        if mountings or parameters.imus_file:
            known = ", ".join(mountings) or "none: each is aligned from motion"
            self.get_logger().info(f"IMUs whose mounting {name} tells: {known}")

    def _subscribe(self) -> None:
        for sensor in self._settings.sensors:
            self._cameras[sensor] = self.create_subscription(
                SkeletonArray,
                f"kinect_{sensor}/skeletons",
                partial(self._on_skeletons, sensor),
                SENSOR_QOS,
                raw=True,
            )
        if not self._settings.extrinsics_file:
            self.create_subscription(TFMessage, "/tf_static", self._on_tf_static, LATCHED_QOS)
        self.create_subscription(TimeReference, "clock_offsets", self._on_clock, LATCHED_QOS)

    def _on_skeletons(self, sensor: str, data: bytes, info: dict[str, Any]) -> None:
        taken_ns = self.get_clock().now().nanoseconds
        # What the IMUs have sent until now is known first.
        self._take_imus()
        self._take_frame(sensor, data, info, taken_ns)
        # Sensors of one phase deliver together: to be woken for each costs more than to look.
        for other, subscription in self._cameras.items():
            for more, noted in waiting(subscription):
                self._take_frame(other, more, noted, taken_ns)
        if self.pipeline.holds_frames:
            self._patience.reset()
        self._learn()

    def _take_frame(self, sensor: str, data: bytes, info: dict[str, Any], taken_ns: int) -> None:
        (persons,) = self._readers[sensor].read([data])
        if isinstance(persons, InputError):
            self._counters.add("malformed_skeletons")
            self.get_logger().warning(str(persons), throttle_duration_sec=5.0)
            return
        sample = self._selector.select(persons)
        if sample is not None:
            if sensor == self._settings.sensors[0]:
                is_simulated = self.get_clock().ros_time_is_active
                published_ns = taken_ns if is_simulated else info["source_timestamp"]
                self._stages.note_taken(sample.stamp_ns, published_ns, taken_ns)
            self.pipeline.add_skeleton(sample)
            missing = len(sample.tracking_state) - int(np.count_nonzero(sample.tracking_state))
            self._counters.add("joints_not_tracked", missing)

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
            self.pipeline.add_imu(block.rows(np.argsort(block.stamps_ns)))

    def _on_tf_static(self, message: TFMessage) -> None:
        for transform in message.transforms:
            self._static_transforms[transform.child_frame_id] = transform
        try:
            placed = transforms_to_map(self._static_transforms.values())
        except InputError as error:
            self._counters.add("malformed_transforms")
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        if all(sensor in placed for sensor in self._settings.sensors):
            extrinsics: Extrinsics = extrinsics_from_map(
                {sensor: placed[sensor] for sensor in self._settings.sensors}
            )
            self.pipeline.place_sensors(replace(extrinsics, clocks=dict(self.pipeline.clocks)))

    def _on_clock(self, message: TimeReference) -> None:
        self.pipeline.use_clocks({**self.pipeline.clocks, message.source: clock_of(message)})

    def _publish_prediction(self) -> None:
        self._take_imus()
        estimates = self.pipeline.predict_block(self.get_clock().now().nanoseconds)
        if estimates is not None:
            self._send(estimates)

    def _learn(self) -> None:
        """What may wait until the estimate has gone out."""
        self.pipeline.learn()
        self._announce_shape()

    def _send(self, estimates: EstimateBlock) -> None:
        now_ns = self.get_clock().now().nanoseconds
        # Clocks are put right to within some milliseconds: a sample may seem to be of later.
        latencies_s = np.maximum(now_ns - estimates.newest_ns, 0) / NS_PER_S
        self._latency_s = float(latencies_s[-1])
        if self._bytes is None:
            model, body_id = self.pipeline.model, self._body_id
            self._bytes = EstimateBytes(model, body_id, self._typestore, estimates[0])
        for topic, rows in self._bytes.write(estimates, latencies_s):
            for data in rows:
                self._publishers_by_topic[topic].publish(data.tobytes())
        stamp_ns = int(estimates.stamps_ns[-1])
        self._stages.note_told(stamp_ns, self.get_clock().now().nanoseconds)

    def _announce_shape(self) -> None:
        """Publish the person's tree, and save the measures, once they are known."""
        shape, path = self.pipeline.shape, self._settings.shape_file
        if shape is None or shape is self._announced_shape:
            return
        self._announced_shape = shape
        urdf = make_urdf(self.pipeline.model, shape, self._body_id)
        self._urdf_publisher.publish(to_string(urdf))
        if path and not Path(path).exists():
            try:
                save_body_shape(Path(path), self.pipeline.model, shape, self._body_id)
            except InputError as error:
                self.get_logger().error(str(error))

    def _report(self) -> Report:
        counts = self.pipeline.counters.as_dict()
        estimates = counts["estimates"]
        is_tracking = estimates > self._reported_estimates
        self._reported_estimates = estimates
        message = self.pipeline.status
        if message == "tracking" and not is_tracking:
            message = "no skeletons: the sensors see nobody, or are silent"
        imus, uses = self.pipeline.imus, self.pipeline.imu_uses
        idle = [use for use in uses if use.reason]
        if is_tracking and idle:
            message = f"tracking without the IMU on {idle[0]}"
            if len(idle) > 1:
                message += f"; {len(idle) - 1} more, see the values"
        unused = self._unused_sensors()
        if unused:
            message += f"; not used: {', '.join(unused)}, add it to sensors"
        return Report(
            level=Level.OK if is_tracking and not idle else Level.WARN,
            message=message,
            values={
                "estimator": self._settings.estimator,
                "sensors": ", ".join(self._settings.sensors),
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
                **self._selector.counters.as_dict("person/"),
                **self.pipeline.aligner.counters.as_dict("alignment/"),
            },
        )

    def _unused_sensors(self) -> tuple[str, ...]:
        """Cameras that publish and are not used; the graph lists what we subscribe to as well."""
        topics = self.get_topic_names_and_types()
        return unused_sensors(topics, self._settings.sensors, self.get_namespace())


def main() -> None:
    """Run the node."""
    run_node(FusionNode, parameters=FusionParameters)
