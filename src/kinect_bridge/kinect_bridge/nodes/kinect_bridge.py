"""The node: one sensor's skeletons, from any source, as ``kinect_<name>/skeletons``."""

from functools import partial
from typing import Any

import numpy as np
import rclpy
from pose_msgs.msg import SkeletonArray
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data

from kinect_bridge.conversions import to_skeleton_array
from kinect_bridge.nodes.message_types import message_type
from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources import make_source
from kinect_bridge.sources.source import SkeletonFrame, Topic
from pose_core.counters import Counters
from pose_core.joints import TrackingState
from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher, Report
from pose_node.nodes.running import run_node

STATE_COUNTERS = tuple(f"joints_{state.name.lower()}" for state in TrackingState)


class KinectBridge(Node):
    """Publishes each frame of a source as soon as the source gives it.

    Args:
        **options: As for ``rclpy.node.Node``.

    Raises:
        PoseError: If the source or a parameter is not what it should be.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("kinect_bridge", **options)
        parameters = declare_parameters(self, KinectBridgeParameters)
        name = parameters.checked_name()
        self._frame_id = f"kinect_{name}_optical_frame"
        self._exits_at_end = parameters.exit_at_end
        self._counters = Counters("frames_published", "frames_nobody_seen", *STATE_COUNTERS)
        self._source = make_source(parameters)
        self._publisher = self.create_publisher(
            SkeletonArray, f"kinect_{name}/skeletons", qos_profile_sensor_data
        )
        self._diagnostics = DiagnosticsPublisher(
            self, self._report, hardware_id=self._source.hardware_id
        )
        self._timer = self.create_timer(0.0, self._publish_due)
        self._wake = self.create_guard_condition(self._publish_due)
        self._hears = [self._subscribe(topic) for topic in self._source.topics]
        self._source.start(self._now_ns, self._wake.trigger)

    def destroy_node(self) -> None:
        """End the source, then the node."""
        self._source.close()
        super().destroy_node()

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _subscribe(self, topic: Topic) -> Any:
        qos = QoSProfile(depth=topic.depth, reliability=ReliabilityPolicy.BEST_EFFORT)
        if topic.latched:
            qos.reliability = ReliabilityPolicy.RELIABLE
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        receive = partial(self._source.receive, topic=topic.name)
        return self.create_subscription(message_type(topic), topic.name, receive, qos)

    def _publish_due(self) -> None:
        """Publish what is due, and sleep until the next is, or until the source wakes us."""
        while (frame := self._source.take()) is not None:
            self._publisher.publish(to_skeleton_array(frame, self._frame_id))
            self._count(frame)
        wait_ns = self._source.wait_ns()
        if wait_ns is not None:
            # Each wait is reckoned from the clock anew: errors of the timer do not add up.
            self._timer.timer_period_ns = wait_ns
            self._timer.reset()
        elif not self._timer.is_canceled():
            self._timer.cancel()
            self.get_logger().info(self._source.report().message)
            self._diagnostics.publish()
            if self._exits_at_end and self._source.is_finished:
                rclpy.try_shutdown(context=self.context)

    def _count(self, frame: SkeletonFrame) -> None:
        self._counters.add("frames_published")
        self._counters.add("frames_nobody_seen", not frame.person)
        counts = np.bincount(frame.tracking_state.ravel(), minlength=len(STATE_COUNTERS))
        for name, count in zip(STATE_COUNTERS, counts, strict=True):
            self._counters.add(name, int(count))

    def _report(self) -> Report:
        report = self._source.report()
        values = {**report.values, **self._counters.as_dict()}
        return Report(level=report.level, message=report.message, values=values)


def main() -> None:
    """Run the node."""
    run_node(KinectBridge, parameters=KinectBridgeParameters)
