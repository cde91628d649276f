"""The node: reads serial ports, publishes ``imu_<segment>/data_raw``, ``mag`` and ``data``."""

import math
from pathlib import Path
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, MagneticField

from imu_bridge.conversions import SegmentMessages
from imu_bridge.devices import PortConfig, read_devices
from imu_bridge.nodes.health import Health
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.pipeline import ImuBatch, ImuPipeline
from imu_bridge.serial_source import SerialSource
from pose_core.errors import ParameterError
from pose_node.node_status import Level, Report
from pose_node.nodes.managed import ManagedNode
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer


class ImuBridge(ManagedNode[ImuBridgeParameters]):
    """Publishes the samples of IMUs on this machine's serial ports."""

    def __init__(self, **options: Any) -> None:
        self._sources: list[SerialSource] = []
        super().__init__("imu_bridge", ImuBridgeParameters, **options)

    def configure(self) -> None:
        """Read the nodes file, create the filters and publishers."""
        parameters = self.settings
        if not parameters.nodes_file:
            raise ParameterError(
                "nodes_file is not set: name a YAML file of node ids and segments, such as the "
                "package's config/imu_nodes.yaml"
            )
        sink = PortConfig(name=parameters.port, baudrate=parameters.baudrate)
        devices = read_devices(Path(parameters.nodes_file), sink)
        nodes, self._ports = devices.nodes, devices.ports
        parsers = [port.make_parser() for port in self._ports]
        self._pipeline = ImuPipeline(nodes, parameters, parsers)
        self._messages = [
            SegmentMessages(node.segment, parameters.inclination_stddev) for node in nodes
        ]
        self._raw = [self._publisher(Imu, node.segment, "data_raw") for node in nodes]
        self._mag = [self._publisher(MagneticField, node.segment, "mag") for node in nodes]
        self._data = [self._publisher(Imu, node.segment, "data") for node in nodes]
        self.diagnostics.hardware_id = ", ".join(port.name for port in self._ports)

    def activate(self) -> None:
        """Open the ports; the filters keep their estimates of biases and fields."""
        # Each port is read in a thread; everything else happens in the executor's.
        self._arrived = self.create_guard_condition(self._on_arrival)
        self._several = len(self._ports) > 1
        if self._several:
            # Processed in batches: many small pieces would cost more.
            steady_timer(self, self.settings.read_period, self._on_arrival)
        for index, port in enumerate(self._ports):
            self._open(index, port)
        self._health = Health(self._pipeline, self._sources, self._ports)
        self._error = ""  # last logged one; empty: none at present

    def deactivate(self) -> None:
        """Close the ports."""
        for source in self._sources:
            source.close()
        self._sources.clear()

    def report(self) -> Report:
        """State of ports and IMUs; errors and their ends are also logged."""
        report = self._health.report(self.get_clock().now().nanoseconds)
        error = report.message if report.level is Level.ERROR else ""
        if error and not self._error:
            self.get_logger().error(error)
        elif self._error and not error:
            self.get_logger().info(report.message)
        self._error = error
        return report

    def _open(self, index: int, port: PortConfig) -> None:
        source = SerialSource(
            port.name,
            port.baudrate,
            clock=lambda: self.get_clock().now().nanoseconds,
            notify=(lambda: None) if self._several else self._arrived.trigger,
            wait_s=self.settings.wait_for_port,
            read_period_s=self.settings.read_period,
            index=index,
        )
        self._sources.append(source)

    def _publisher(self, message_type: type, segment: str, name: str) -> Any:
        # Without events the executor does not check each publisher at each wake-up, which would
        # cost most of the CPU time with 27 of them; subscriptions still warn of incompatible QoS.
        return self.create_publisher(
            message_type,
            f"imu_{segment}/{name}",
            qos_profile_sensor_data,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )

    def _on_arrival(self) -> None:
        chunks = [chunk for source in self._sources for chunk in source.take()]
        if chunks:
            self._publish(self._pipeline.process(chunks))

    def _publish(self, batch: ImuBatch) -> None:
        raw = (batch.raw_angular_velocity, batch.raw_acceleration, batch.raw_magnetic_field)
        data = (batch.angular_velocity, batch.acceleration, batch.orientation, batch.heading_stddev)
        columns = (column.tolist() for column in (batch.node, *raw, *data))
        for stamp_ns, row in zip(batch.stamp_ns, zip(*columns, strict=True), strict=True):
            node, raw_rate, raw_acceleration, field, *oriented = row
            messages = self._messages[node]
            self._raw[node].publish(messages.raw(stamp_ns, raw_rate, raw_acceleration))
            if not math.isnan(field[0]):
                self._mag[node].publish(messages.magnetic_field(stamp_ns, field))
            _, _, orientation, _ = oriented
            if not math.isnan(orientation[3]):
                self._data[node].publish(messages.oriented(stamp_ns, *oriented))


def main() -> None:
    """Run the node."""
    run_node(ImuBridge, parameters=ImuBridgeParameters)
