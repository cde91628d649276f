"""The IMUs' calibration with the running sensors, for ``./pose calibrate imu``."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

from pose_msgs.msg import SkeletonArray
from rclpy.node import Node
from sensor_msgs.msg import Imu, TimeReference
from tf2_msgs.msg import TFMessage

from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.imus.imu_calibration import ImuCalibration, ImuCalibrationResult
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_core.api import ChosenPerson, Clock, Extrinsics, ImuBlock, SkeletonSample
from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_core.joints import SEGMENTS
from pose_fusion.nodes.inbox import Inbox
from pose_fusion.sample_reader import read_imus
from pose_io.clock_messages import clock_of
from pose_io.names import imu_topic, skeletons_topic
from pose_io.skeleton_messages import skeleton_samples
from pose_io.static_transforms import StaticTransforms
from pose_node.nodes.qos import latched, sensor_data
from pose_node.nodes.running import node_of_tool, spin_until

DEPTH = 50  # [messages]
SENSOR_QOS = sensor_data(DEPTH)


class ImuCalibrationNode(Node):
    """Passes samples to an :class:`ImuCalibration`, once the poses of the Kinects are known.

    Args:
        parameters: Of the calibration.
        extrinsics: Where the Kinects are; None: as the calibration node publishes it.
    """

    def __init__(
        self, parameters: ImuCalibrationParameters, extrinsics: Extrinsics | None = None
    ) -> None:
        super().__init__("imu_calibration")
        self._settings = parameters
        self.extrinsics = extrinsics
        self.calibration: ImuCalibration | None = None
        self.counters = Counters(
            "malformed_frames",
            "malformed_transforms",
            "malformed_clocks",
            "imu_without_orientation",
        )
        self._selector = ChosenPerson(parameters.person, extrinsics)
        self._static_transforms = StaticTransforms()
        self._clocks: dict[str, Clock] = {}
        self._imus = Inbox(self, Imu, {name: imu_topic(name) for name in SEGMENTS}, SENSOR_QOS)
        for sensor in parameters.sensors:
            callback = partial(self._on_skeletons, sensor)
            self.create_subscription(SkeletonArray, skeletons_topic(sensor), callback, SENSOR_QOS)
        if extrinsics is None:
            self.create_subscription(TFMessage, "tf_static", self._on_tf_static, latched(DEPTH))
            self.create_subscription(TimeReference, "clock_offsets", self._on_clock, latched(DEPTH))
        else:
            self.calibration = ImuCalibration(parameters, extrinsics)

    @property
    def missing(self) -> str:
        """What the person should do now."""
        if self.calibration is None:
            return (
                "waiting for the poses of the Kinects: run the calibration node, or name a "
                "calibrated session with -o"
            )
        return self.calibration.missing

    @property
    def progress(self) -> float:
        """Progress, 0 to 1."""
        return 0.0 if self.calibration is None else self.calibration.progress

    def _on_tf_static(self, message: TFMessage) -> None:
        with self._rejecting("malformed_transforms"):
            found = self._static_transforms.extrinsics(message, self._settings.sensors)
            if self.calibration is None and found is not None:
                self.extrinsics = replace(found, clocks=dict(self._clocks))
                self._selector.use_extrinsics(self.extrinsics)
                self.calibration = ImuCalibration(self._settings, self.extrinsics)

    def _on_clock(self, message: TimeReference) -> None:
        with self._rejecting("malformed_clocks"):
            self._clocks[message.source] = clock_of(message)
            if self.calibration is not None and self.extrinsics is not None:
                self.extrinsics = replace(self.extrinsics, clocks=dict(self._clocks))
                self.calibration.pipeline.use_clocks(self._clocks)

    def _on_skeletons(self, sensor: str, message: SkeletonArray) -> None:
        self._take_imus()
        with self._rejecting("malformed_frames"):
            for sample in self._selector.select(skeleton_samples(message, sensor)):
                self._take(sample)

    @contextmanager
    def _rejecting(self, counter: str) -> Iterator[None]:
        """Count and report an InputError about a message."""
        try:
            yield
        except InputError as error:
            self.counters.add(counter)
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)

    def _take_imus(self) -> None:
        taken = self._imus.take()
        if taken:
            self._take(read_imus(taken, self.counters))

    def _take(self, sample: SkeletonSample | ImuBlock) -> None:
        if self.calibration is not None:
            self.calibration.add(sample)


def calibrate_imus_live(
    parameters: ImuCalibrationParameters,
    extrinsics: Extrinsics | None,
    timeout_s: float,
    on_progress: Callable[[float, str], None],
) -> tuple[ImuCalibrationResult, Extrinsics]:
    """Calibrate the IMUs with the running sensors.

    Args:
        parameters: Of the calibration.
        extrinsics: Where the Kinects are; None: as the calibration node publishes it.
        timeout_s: How long to wait [s] in all.
        on_progress: Told now and then how far it is, 0 to 1, and what is missing.

    Returns:
        The result, and where the Kinects are.

    Raises:
        CalibrationError: If nothing could be found in time; the message says what was missing.
    """
    make = partial(ImuCalibrationNode, parameters, extrinsics)
    with node_of_tool(make) as (node, executor):
        spin_until(
            executor,
            lambda: node.calibration is not None and node.calibration.is_done,
            timeout_s,
            lambda: on_progress(node.progress, node.missing),
        )
        if node.calibration is None or node.extrinsics is None:
            raise CalibrationError(f"not calibrated within {timeout_s:.0f} s: {node.missing}")
        unused = [f"{count} {why}" for why, count in node.counters.as_dict().items() if count]
        if unused:
            node.get_logger().warning(f"not used: {', '.join(unused)}")
        return node.calibration.finish(), node.extrinsics
