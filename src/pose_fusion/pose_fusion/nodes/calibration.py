"""The calibration node: estimates extrinsics and clock offsets from skeletons."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import TransformStamped
from pose_msgs.msg import SkeletonArray
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, TimeReference
from tf2_msgs.msg import TFMessage

from pose_calibration.files.extrinsics_file import load_extrinsics_of, save_extrinsics
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.live.live_calibration import LiveCalibration
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_calibration.live.watchdog import Moved
from pose_core.api import Clock, Clocks, Extrinsics
from pose_core.counters import Counters
from pose_core.errors import InputError, ParameterError
from pose_core.joints import SEGMENT_ENDS
from pose_fusion.conversions import to_clock_messages, to_extrinsics_messages, to_static_tf
from pose_fusion.nodes.calibration_report import calibration_report
from pose_fusion.nodes.inbox import Inbox
from pose_fusion.nodes.services import offer_trigger
from pose_fusion.nodes.standstill import Standstill
from pose_fusion.sample_reader import read_imus
from pose_io.cdr.skeleton_bytes import Persons, SkeletonReader
from pose_io.names import imu_topic, sensor_frame, skeletons_topic
from pose_io.static_transforms import StaticTransforms
from pose_node.kept import kept_file
from pose_node.node_status import Report
from pose_node.nodes.declaring import overrides_of
from pose_node.nodes.managed import ManagedNode
from pose_node.nodes.qos import latched, sensor_data
from pose_node.nodes.running import node_of_tool, run_node, spin_until
from pose_node.nodes.steady_timer import steady_timer

# Queue for the two seconds that a solution may take.
FRAMES_QOS = sensor_data(100)
IMU_QOS = sensor_data(250)
PERIOD_S = 0.1  # [s] between reads of all samples, which are not urgent
TF_STATIC_QUEUE = 100  # [-] latched messages on /tf_static, of several publishers
EVERY_OTHER = 2  # [-] IMU sample is used; 50 of 100 Hz suffice


class CalibrationNode(ManagedNode[LiveCalibrationParameters]):
    """Passes samples to a :class:`LiveCalibration`, publishes the result and saves it.

    Attributes:
        calibration: Processes the samples.

    Raises:
        PoseError: If the file or a parameter is invalid.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("calibration", LiveCalibrationParameters, **options)

    def configure(self) -> None:
        """Load the file, if there is one, and create the publishers."""
        parameters = self.settings
        self._file = Path(parameters.file).expanduser() if parameters.file else None
        known = None
        if self._file is not None and self._file.exists():
            known = load_extrinsics_of(self._file, parameters.sensors)
        elif self._file is not None and not self._file.parent.is_dir():
            raise ParameterError(f"file = {self._file}: expected a file in an existing folder")
        self._kept = kept_file(self.get_fully_qualified_name(), parameters.run)
        kept = None
        if known is None and self._kept is not None and self._kept.exists():
            with suppress(InputError):  # of other sensors, for example
                kept = load_extrinsics_of(self._kept, parameters.sensors)
        self.calibration = LiveCalibration(parameters, known or kept)
        if kept is not None and kept.body is None:  # not the final solution, which has a body
            self.calibration.restart(until_final=True)
        self.changes["person"] = self.calibration.selector.choose_by
        self._counters = Counters(
            "malformed_frames",
            "malformed_transforms",
            "accelerations_in_other_frames",
            "imu_without_orientation",
        )
        self._trouble = ""
        self._moved: Moved | None = None  # what was logged
        self._published_sources: tuple[str, ...] = ()
        one_each = latched(len(parameters.sensors))
        self._extrinsics_publisher = self.create_publisher(TransformStamped, "extrinsics", one_each)
        self._clock_publisher = self.create_publisher(TimeReference, "clock_offsets", one_each)
        self._tf_publisher = self.create_publisher(TFMessage, "tf_static", latched(1))

    def activate(self) -> None:
        """Subscribe to the sensors; publish what is already known."""
        sensors = self.settings.sensors
        frames = {sensor: skeletons_topic(sensor) for sensor in sensors}
        self._readers = {sensor: SkeletonReader(sensor) for sensor in frames}
        self._frames = Inbox(self, SkeletonArray, frames, FRAMES_QOS)
        self._reference_frame = sensor_frame(sensors[0])
        self.create_subscription(
            Imu, f"kinect_{sensors[0]}/imu", self._on_acceleration, qos_profile_sensor_data
        )
        topics = {segment: imu_topic(segment) for segment in SEGMENT_ENDS}
        self._imus = Inbox(self, Imu, topics, IMU_QOS)
        self._standstill = Standstill({**self._frames.queues, **self._imus.queues})
        steady_timer(self, PERIOD_S, self._take)
        offer_trigger(self, "~/calibrate", self._on_calibrate)
        offer_trigger(self, "~/progress", self._on_progress)
        offer_trigger(self, "~/save", self._on_save)
        if self.calibration.extrinsics is not None:
            self._publish(self.calibration.extrinsics)
        elif self.settings.keep_given:
            self._given = StaticTransforms()
            self.create_subscription(
                TFMessage, "tf_static", self._on_tf_static, latched(TF_STATIC_QUEUE)
            )

    def _on_tf_static(self, message: TFMessage) -> None:
        """Keep to the poses that another node publishes, until some are found here."""
        if self.calibration.extrinsics is not None:
            return
        try:
            known = self._given.extrinsics(message, self.settings.sensors)
        except InputError as error:
            self._counters.add("malformed_transforms")
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        if known is not None:
            self.calibration = LiveCalibration(self.settings, known)
            self.changes["person"] = self.calibration.selector.choose_by
            self._publish_extrinsics(known)
            self.get_logger().info("the sensors' poses are those of /tf_static: see keep_given")

    def restart_time(self) -> None:
        """Discard the samples, whose stamps will be repeated; keep the calibration."""
        self.calibration.restart_time()

    def _take(self) -> None:
        """Read all received messages; end if deaf."""
        self._standstill.check()
        self._take_imus()
        taken = self._frames.take()
        by_sensor = [self._read(sensor, datas) for sensor, datas in taken.items()]
        for persons in merge(*by_sensor, key=lambda persons: persons[0].stamp_ns):
            self._add(persons)

    def _read(self, sensor: str, datas: Sequence[bytes]) -> list[Persons]:
        """One sensor's frames with at least one person."""
        frames = []
        for persons in self._readers[sensor].read(datas):
            if isinstance(persons, InputError):
                self._counters.add("malformed_frames")
                self.get_logger().warning(str(persons), throttle_duration_sec=5.0)
            elif persons:
                frames.append(persons)
            else:
                self.calibration.add(persons)  # counts them
        return frames

    def _add(self, persons: Persons) -> None:
        extrinsics = self.calibration.add(persons)
        known, self._moved = self._moved, self.calibration.moved
        if self._moved not in (known, None):
            self.get_logger().warning(self.calibration.status)
        clocks = self.calibration.take_clocks()
        if clocks is not None:
            self._publish_clocks(clocks)
        if extrinsics is not None:
            self._publish(extrinsics)
            if self._kept is not None:
                with suppress(InputError):
                    save_extrinsics(self._kept, extrinsics)
            if self._file is not None:
                self._save(self._file, extrinsics)

    def _take_imus(self) -> None:
        taken = {s: datas[::EVERY_OTHER] for s, datas in self._imus.take().items()}
        if taken:
            self.calibration.imu_memory.add(read_imus(taken, self._counters))

    def _on_acceleration(self, message: Imu) -> None:
        if message.header.frame_id != self._reference_frame:
            self._counters.add("accelerations_in_other_frames")
            return
        a = message.linear_acceleration
        self.calibration.accelerometer.add(np.array([a.x, a.y, a.z]))

    def _publish(self, extrinsics: Extrinsics) -> None:
        self._publish_clocks(extrinsics.clocks)
        self._publish_extrinsics(extrinsics)
        placed = {sensor: extrinsics.T_map_sensor(sensor) for sensor in extrinsics.sensors}
        self._tf_publisher.publish(to_static_tf(placed))
        self.get_logger().info(self.calibration.status)

    def _publish_extrinsics(self, extrinsics: Extrinsics) -> None:
        stamp_ns = self.get_clock().now().nanoseconds
        for message in to_extrinsics_messages(extrinsics, stamp_ns):
            self._extrinsics_publisher.publish(message)

    def _publish_clocks(self, clocks: Clocks) -> None:
        # Also publish a source again that was published before and now agrees.
        published = {source: Clock() for source in self._published_sources} | dict(clocks)
        self._published_sources = tuple(published)
        stamp_ns = self.get_clock().now().nanoseconds
        for message in to_clock_messages(published, stamp_ns):
            self._clock_publisher.publish(message)

    def _save(self, file: Path, extrinsics: Extrinsics) -> None:
        try:
            save_extrinsics(file, extrinsics)
        except InputError as error:
            self._trouble = str(error)
            self.get_logger().error(self._trouble)
        else:
            self._trouble = ""
            self.get_logger().info(f"saved {file}")

    def _on_calibrate(self) -> tuple[bool, str]:
        self.calibration.restart()
        return True, "collecting again: walk about, raise the arms"

    def _on_progress(self) -> tuple[bool, str]:
        calibration = self.calibration
        return calibration.is_finished, f"{calibration.progress:.0%}: {calibration.status}"

    def _on_save(self) -> tuple[bool, str]:
        extrinsics = self.calibration.extrinsics
        if self._file is None:
            return False, "no file to save to: start the node with the parameter 'file'"
        if extrinsics is None:
            return False, f"nothing to save yet: {self.calibration.status}"
        self._save(self._file, extrinsics)
        return not self._trouble, self._trouble or f"saved {self._file}"

    def report(self) -> Report:
        """Progress and accuracy of the calibration."""
        return calibration_report(self.calibration, self._counters, self._trouble)


def calibrate_live(
    options: Mapping[str, Any], timeout_s: float, on_progress: Callable[[LiveCalibration], None]
) -> Extrinsics:
    """Run the node until it has calibrated the running sensors, for ``./pose calibrate live``.

    Args:
        options: Parameters of the calibration node by name; None: the default.
        timeout_s: Total time limit [s].
        on_progress: Called periodically with the progress.

    Raises:
        CalibrationError: If there is no result in time; the message says what was missing.
    """
    overrides = overrides_of(LiveCalibrationParameters, {**options, "keep_given": False})
    with node_of_tool(partial(CalibrationNode, parameter_overrides=overrides)) as (node, executor):
        spin_until(
            executor,
            lambda: node.calibration.is_finished,
            timeout_s,
            lambda: on_progress(node.calibration),
        )
        found, sensors = node.calibration.extrinsics, node.calibration.parameters.sensors
        if found is None or set(found.sensors) != set(sensors):
            missing = node.calibration.missing
            raise CalibrationError(f"not calibrated within {timeout_s:.0f} s: {missing}")
        return found


def main() -> None:
    """Run the node."""
    run_node(CalibrationNode, parameters=LiveCalibrationParameters)
