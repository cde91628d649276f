"""The node: one sensor's skeletons, from any source, as ``kinect_<name>/skeletons``."""

from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
import rclpy
from pose_msgs.msg import SkeletonArray
from rclpy.qos import qos_profile_sensor_data

from kinect_bridge.conversions import to_skeleton_array
from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.source import SOURCES, SkeletonFrame, SkeletonSource, SourceTopic
from pose_core.counters import Counters
from pose_core.joints import TrackingState
from pose_io.names import sensor_frame, skeletons_topic
from pose_node.node_status import Report
from pose_node.nodes.managed import ManagedNode
from pose_node.nodes.message_types import message_class
from pose_node.nodes.qos import latched, sensor_data
from pose_node.nodes.running import run_node

STATE_COUNTERS = tuple(f"joints_{state.name.lower()}" for state in TrackingState)


class KinectBridge(ManagedNode[KinectBridgeParameters]):
    """Publishes the frames of a source.

    Raises:
        PoseError: If the source or a parameter is invalid.
    """

    def __init__(self, **options: Any) -> None:
        self._counters = Counters("frames_published", "frames_nobody_seen", *STATE_COUNTERS)
        self._source: SkeletonSource | None = None
        super().__init__("kinect_bridge", KinectBridgeParameters, **options)

    def configure(self) -> None:
        """Open the source; a recording is read completely."""
        name = self.settings.name
        self._frame_id = sensor_frame(name)
        self._source = self._make_source()
        self.diagnostics.hardware_id = self._source.hardware_id
        self._publisher = self.create_publisher(
            SkeletonArray, skeletons_topic(name), qos_profile_sensor_data
        )

    def activate(self) -> None:
        """Start the source; a recording restarts."""
        if self._source is None:  # closed by a deactivation
            self._source = self._make_source()
        self._timer = self.create_timer(0.0, self._publish_due)
        self._wake = self.create_guard_condition(self._publish_due)
        for topic in self._source.topics:
            self._subscribe(topic, self._source)
        self._source.start(self._now_ns, self._wake.trigger)

    def deactivate(self) -> None:
        """Close the source."""
        source, self._source = self._source, None
        if source is not None:
            source.close()

    cleanup = deactivate

    def _make_source(self) -> SkeletonSource:
        module, name = SOURCES[self.settings.source].split(".")
        source: SkeletonSource = getattr(import_module(f"kinect_bridge.sources.{module}"), name)(
            self.settings
        )
        return source

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _subscribe(self, topic: SourceTopic, source: SkeletonSource) -> None:
        qos = latched(topic.depth) if topic.latched else sensor_data(topic.depth)
        receive = partial(source.receive, topic=topic.name)
        self.create_subscription(message_class(topic.type_name), topic.name, receive, qos)

    def _publish_due(self) -> None:
        """Publish due frames, and wait until the next is due, or until the source has one."""
        source = self._source
        if source is None:
            return  # called after the source was closed
        while (frame := source.take()) is not None:
            self._publisher.publish(to_skeleton_array(frame, self._frame_id))
            self._count(frame)
        wait_ns = source.wait_ns()
        if wait_ns is not None:
            # Each wait is computed from the clock: errors of the timer do not accumulate.
            self._timer.timer_period_ns = wait_ns
            self._timer.reset()
        elif not self._timer.is_canceled():
            self._timer.cancel()
            self.get_logger().info(source.report().message)
            self.diagnostics.publish()
            if self.settings.exit_at_end and source.is_finished:
                rclpy.try_shutdown(context=self.context)

    def _count(self, frame: SkeletonFrame) -> None:
        self._counters.add("frames_published")
        self._counters.add("frames_nobody_seen", not frame.person)
        counts = np.bincount(frame.tracking_state.ravel(), minlength=len(STATE_COUNTERS))
        for name, count in zip(STATE_COUNTERS, counts, strict=True):
            self._counters.add(name, int(count))

    def report(self) -> Report:
        """State of the source, and counts of published frames."""
        assert self._source is not None
        report = self._source.report()
        return replace(report, values={**report.values, **self._counters.as_dict()})


def main() -> None:
    """Run the node."""
    run_node(KinectBridge, parameters=KinectBridgeParameters)
