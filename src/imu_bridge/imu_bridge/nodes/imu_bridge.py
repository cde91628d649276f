"""The node: a serial port in, ``imu_<segment>/data_raw``, ``mag`` and ``data`` out."""

from pathlib import Path
from typing import Any

import numpy as np
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, MagneticField

from imu_bridge.conversions import SegmentMessages
from imu_bridge.nodes.health import Health
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.pipeline import ImuBatch, ImuPipeline
from imu_bridge.segments import read_nodes
from imu_bridge.serial_source import SerialSource
from pose_common.errors import ParameterError
from pose_common.nodes.declaring import declare_parameters
from pose_common.nodes.diagnostics import DiagnosticsPublisher
from pose_common.nodes.running import run_node


class ImuBridge(Node):
    """Publishes what the nodes of a star network of IMUs send to their sink."""

    def __init__(self, **options: Any) -> None:
        super().__init__("imu_bridge", **options)
        parameters = declare_parameters(self, ImuBridgeParameters)
        if not parameters.nodes_file:
            raise ParameterError(
                "nodes_file is not set: name a YAML file of node ids and segments, such as the "
                "package's config/imu_nodes.yaml"
            )
        nodes = read_nodes(Path(parameters.nodes_file))
        self._pipeline = ImuPipeline(
            nodes,
            beta=parameters.beta,
            bias_window_s=parameters.gyro_bias_window,
            max_gap_s=parameters.max_gap,
            max_drift=parameters.max_clock_drift,
            transport_delay_s=parameters.transport_delay,
        )
        self._messages = [
            SegmentMessages(node.segment, parameters.inclination_stddev, parameters.heading_stddev)
            for node in nodes
        ]
        self._raw = [self._publisher(Imu, node.segment, "data_raw") for node in nodes]
        self._mag = [self._publisher(MagneticField, node.segment, "mag") for node in nodes]
        self._data = [self._publisher(Imu, node.segment, "data") for node in nodes]
        # The port is read in a thread; everything else happens in the executor's.
        arrived = self.create_guard_condition(self._on_arrival)
        self._source = SerialSource(
            parameters.port,
            parameters.baudrate,
            clock=lambda: self.get_clock().now().nanoseconds,
            notify=arrived.trigger,
            wait_s=parameters.wait_for_port,
            read_period_s=parameters.read_period,
        )
        health = Health(self._pipeline, self._source)
        self._diagnostics = DiagnosticsPublisher(
            self,
            lambda: health.report(self.get_clock().now().nanoseconds),
            hardware_id=parameters.port,
        )

    def destroy_node(self) -> None:
        """Close the port, then the node."""
        if hasattr(self, "_source"):
            self._source.close()
        super().destroy_node()

    def _publisher(self, message_type: type, segment: str, name: str) -> Any:
        # Without events the executor need not look at each publisher whenever it wakes, which
        # with 27 of them would cost more than all the rest; a subscription still warns of a QoS
        # that does not fit.
        return self.create_publisher(
            message_type,
            f"imu_{segment}/{name}",
            qos_profile_sensor_data,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def _on_arrival(self) -> None:
        self._publish(self._pipeline.process(self._source.take()))

    def _publish(self, batch: ImuBatch) -> None:
        has_field = ~np.isnan(batch.raw_magnetic_field[:, 0])
        has_orientation = ~np.isnan(batch.orientation[:, 3])
        raw_rates = batch.raw_angular_velocity.tolist()
        raw_accelerations = batch.raw_acceleration.tolist()
        fields = batch.raw_magnetic_field.tolist()
        rates = batch.angular_velocity.tolist()
        accelerations = batch.acceleration.tolist()
        orientations = batch.orientation.tolist()
        for row, node in enumerate(batch.node.tolist()):
            messages, stamp_ns = self._messages[node], batch.stamp_ns[row]
            self._raw[node].publish(messages.raw(stamp_ns, raw_rates[row], raw_accelerations[row]))
            if has_field[row]:
                self._mag[node].publish(messages.magnetic_field(stamp_ns, fields[row]))
            if has_orientation[row]:
                self._data[node].publish(
                    messages.oriented(
                        stamp_ns,
                        rates[row],
                        accelerations[row],
                        orientations[row],
                        bool(batch.has_heading[row]),
                    )
                )


def main() -> None:
    """Run the node."""
    run_node(ImuBridge)
