"""The node: replays one sensor of a recording as ``kinect_<name>/skeletons``."""

from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from pose_msgs.msg import SkeletonArray
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

from kinect_bridge.conversions import to_skeleton_array
from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.replay import Replay, make_schedule
from pose_core.counters import Counters
from pose_core.errors import ParameterError
from pose_core.joints import TrackingState
from pose_io.recordings.formats import read_recording
from pose_io.recordings.timeline import make_timeline
from pose_node.level import Level
from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher, Report
from pose_node.nodes.running import run_node

LONGEST_DELAY_NS = 10_000_000_000  # [ns] by which a replay may begin late and yet catch up
LATE_NS = 200_000_000  # [ns] beyond what a busy machine does now and then
STATE_COUNTERS = tuple(f"joints_{state.name.lower()}" for state in TrackingState)


class KinectBridge(Node):
    """Publishes each frame of a recording when it is due.

    Args:
        **options: As for ``rclpy.node.Node``.

    Raises:
        PoseError: If the file or a parameter is not what it should be.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("kinect_bridge", **options)
        parameters = declare_parameters(self, KinectBridgeParameters)
        name = parameters.checked_name()
        if not parameters.file:
            raise ParameterError("file is empty: give the path of a recording to replay")
        now_ns = self._now_ns()
        start_at_ns = parameters.start_at_ns(now_ns)
        recording = read_recording(Path(parameters.file).expanduser(), parameters.format)
        self._recording = recording
        self._stream = recording.stream(parameters.sensor)
        timelines = [make_timeline(stream, parameters.clock) for stream in recording.streams]
        self._timeline = timelines[recording.streams.index(self._stream)]
        schedule = make_schedule(
            recording,
            timelines,
            self._stream.name,
            start_at_ns=start_at_ns if parameters.start_at else self._now_ns(),
            rate=parameters.rate,
            loop=parameters.loop,
        )
        self._replay = Replay(schedule)
        self._frame_id = f"kinect_{name}_optical_frame"
        self._exits_at_end = parameters.exit_at_end
        self._counters = Counters(
            "frames_published", "frames_nobody_seen", "frames_skipped", *STATE_COUNTERS
        )
        if parameters.start_at:
            self._skip_missed()
        self._late_ns = 0  # [ns] longest since the last report
        self._reported = (now_ns, 0)  # [ns] and frames, at the last report

        self._publisher = self.create_publisher(
            SkeletonArray, f"kinect_{name}/skeletons", qos_profile_sensor_data
        )
        self._diagnostics = DiagnosticsPublisher(self, self._report, hardware_id=self._stream.name)
        self._timer = self.create_timer(0.0, self._publish_due)

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _skip_missed(self) -> None:
        """Go on with the present if this is a restart in the midst of a common replay."""
        skipped = self._replay.skip(self._now_ns() - LONGEST_DELAY_NS)
        if skipped:
            self._counters.add("frames_skipped", skipped)
            self.get_logger().warning(
                f"{skipped} frames were due more than {LONGEST_DELAY_NS // 10**9} s ago: skipped"
            )

    def _publish_due(self) -> None:
        """Publish the frame that is due, if one is, and sleep until the next."""
        due = self._replay.take(self._now_ns())
        if due is not None:
            self._publisher.publish(
                to_skeleton_array(self._stream, due.frame, due.stamp_ns, self._frame_id)
            )
            self._count(due.frame)
            self._late_ns = max(self._late_ns, self._now_ns() - due.stamp_ns)
        wait_ns = self._replay.wait_ns(self._now_ns())
        if wait_ns is None:
            self._timer.cancel()
            self.get_logger().info("recording finished")
            self._diagnostics.publish()
            if self._exits_at_end:
                rclpy.try_shutdown(context=self.context)
        else:
            # Each wait is reckoned from the clock anew: errors of the timer do not add up.
            self._timer.timer_period_ns = wait_ns
            self._timer.reset()

    def _count(self, frame: int) -> None:
        rows = self._stream.rows(frame)
        self._counters.add("frames_published")
        self._counters.add("frames_nobody_seen", not rows)
        states = self._stream.tracking_state[rows.start : rows.stop].ravel()
        for name, count in zip(STATE_COUNTERS, np.bincount(states, minlength=3), strict=True):
            self._counters.add(name, int(count))

    def _report(self) -> Report:
        now_ns = self._now_ns()
        before_ns, before = self._reported
        self._reported = (now_ns, self._replay.played)
        late_ns, self._late_ns = self._late_ns, 0
        elapsed_s = max(now_ns - before_ns, 1) * 1e-9
        fit = self._timeline.fit
        return Report(
            level=Level.WARN if late_ns > LATE_NS else Level.OK,
            message=self._message(now_ns, late_ns),
            values={
                "file": self._recording.source,
                "format": self._recording.format,
                "sensor": self._stream.name,
                "comment": "; ".join(self._recording.comments),
                "progress": f"{self._replay.progress:.4f}",
                "rate_hz": f"{(self._replay.played - before) / elapsed_s:.1f}",
                "late_ms": f"{late_ns * 1e-6:.1f}",
                **self._counters.as_dict(),
                **self._timeline.counts,
                "rows_repeated": self._stream.rows_repeated,
                "clock": "host" if fit is None else "sensor",
                **({} if fit is None else fit.summary()),
            },
        )

    def _message(self, now_ns: int, late_ns: int) -> str:
        if self._replay.finished:
            return "recording finished"
        due_ns = self._replay.schedule.due_ns(self._replay.played)
        if self._replay.played == 0 and due_ns is not None and due_ns > now_ns:
            return f"recording begins in {(due_ns - now_ns) * 1e-9:.1f} s"
        if late_ns > LATE_NS:
            return f"replaying a recording, {late_ns * 1e-9:.1f} s late"
        return "replaying a recording"


def main() -> None:
    """Run the node."""
    run_node(KinectBridge, parameters=KinectBridgeParameters)
