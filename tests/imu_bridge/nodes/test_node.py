"""The bridge in this process, on a pseudo-terminal."""

import os
import tty
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, MagneticField

from imu_bridge.filters import FILTERS
from imu_bridge.nodes.imu_bridge import ImuBridge
from imu_bridge.protocols.star import RawSample, encode
from pose_core.errors import InputError, ParameterError
from pose_core.stamps import nanoseconds

MS = 1_000_000  # [ns]
REST = RawSample(
    node_id=1,
    sequence=0,
    clock_us=0,
    accelerometer=(0, 0, 16384),
    gyroscope=(131, 0, 0),
    magnetometer=(0, 80, -160),
    magnetometer_valid=True,
)


def sample(k: int, node_id: int = 1, **fields) -> bytes:
    return encode(replace(REST, node_id=node_id, sequence=k, clock_us=k * 10_000, **fields))


class Bench:
    """A bridge with subscribers on all topics of two segments."""

    def __init__(self, ros_context, tmp_path: Path, **parameters) -> None:
        self.master, self.slave = os.openpty()
        self._descriptors = [self.master, self.slave]
        tty.setraw(self.slave)
        self._port = tmp_path / f"port_{self.master}"  # a name that no other terminal takes over
        self._port.symlink_to(os.ttyname(self.slave))
        nodes_file = tmp_path / "nodes.yaml"
        nodes_file.write_text("nodes: {1: torso, 6: left_thigh}")
        values = {
            "port": str(self._port),
            "nodes_file": str(nodes_file),
            **parameters,
        }
        self._context = ros_context
        self.received = {
            (segment, name): ros_context.collect(
                message_type, f"imu_{segment}/{name}", qos_profile_sensor_data
            )
            for segment in ("torso", "left_thigh")
            for name, message_type in (("data_raw", Imu), ("mag", MagneticField), ("data", Imu))
        }
        self.diagnostics = ros_context.collect(DiagnosticArray, "/diagnostics")
        self.node = ros_context.add(
            ImuBridge(parameter_overrides=[Parameter(n, value=v) for n, v in values.items()])
        )
        publishers = [p for p in self.node.publishers if p.topic_name.startswith("/imu_")]
        assert len(publishers) == 6
        self.spin_until(lambda: all(p.get_subscription_count() for p in publishers))

    def spin_until(self, condition, what: str = "") -> None:
        self._context.spin_until(condition, what=what)

    def send(self, *frames: bytes) -> None:
        os.write(self.master, b"".join(frames))

    def wait_for(self, count: int, segment: str = "torso", name: str = "data") -> list:
        messages = self.received[segment, name]
        self.spin_until(lambda: len(messages) >= count, f"{count} of {segment}/{name}")
        return messages

    def values(self) -> dict[str, str]:
        """What the newest diagnostics of the bridge say."""
        self.diagnostics.clear()
        self.spin_until(lambda: self.diagnostics, "diagnostics")
        (status,) = self.diagnostics[-1].status
        return {
            "level": str(status.level[0]),
            "message": status.message,
            **{item.key: item.value for item in status.values},
        }

    def close(self) -> None:
        self._port.unlink(missing_ok=True)
        while self._descriptors:
            os.close(self._descriptors.pop())


@pytest.fixture
def bench(ros_context, tmp_path: Path):
    benches = []

    def make(**parameters) -> Bench:
        benches.append(Bench(ros_context, tmp_path, **parameters))
        return benches[-1]

    yield make
    for made in benches:
        made.close()


def test_a_frame_becomes_three_messages_on_the_topics_of_its_segment(bench):
    bench = bench()
    before_ns = bench.node.get_clock().now().nanoseconds
    bench.send(sample(0, 6))
    (data,) = bench.wait_for(1, "left_thigh", "data")
    (raw,) = bench.wait_for(1, "left_thigh", "data_raw")
    (mag,) = bench.wait_for(1, "left_thigh", "mag")
    after_ns = bench.node.get_clock().now().nanoseconds

    for message in (data, raw, mag):
        assert message.header.frame_id == "imu_left_thigh_link"
        assert message.header.stamp == data.header.stamp
    assert before_ns <= nanoseconds(data.header.stamp) <= after_ns
    assert raw.linear_acceleration.z == pytest.approx(9.80665)
    assert raw.angular_velocity.x == pytest.approx(np.radians(1.0), rel=1e-3)
    assert mag.magnetic_field.y == pytest.approx(24e-6)
    assert raw.orientation_covariance[0] == -1.0
    q = data.orientation
    np.testing.assert_allclose([q.x, q.y, q.z, q.w], [0, 0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(
        np.array(data.orientation_covariance).reshape(3, 3), np.diag([0.025, 0.025, 0.12]) ** 2
    )
    assert bench.received["torso", "data"] == []


def test_without_a_magnetometer_the_heading_is_published_as_unknown(bench):
    bench = bench()
    bench.send(sample(0, magnetometer_valid=False))
    (data,) = bench.wait_for(1)
    assert data.orientation_covariance[8] == pytest.approx(np.pi**2)
    assert bench.received["torso", "mag"] == []


def test_stamps_have_the_spacing_of_the_nodes_clock_not_of_the_arrivals(bench):
    bench = bench()
    for k in range(20):
        # A read period lies between two arrivals, but only 1 ms between two samples.
        bench.send(encode(replace(REST, sequence=k, clock_us=k * 1000)))
        messages = bench.wait_for(k + 1)
    stamps = np.array([nanoseconds(message.header.stamp) for message in messages])
    np.testing.assert_allclose(np.diff(stamps), 1 * MS, rtol=0, atol=200)


def test_garbage_and_half_frames_lose_no_whole_frame(bench):
    bench = bench()
    data = b"\x00\xa5\x5a" + sample(0)[:17] + sample(1) + b"\xff\xa5" + sample(2) + sample(3)[:9]
    for start in range(0, len(data), 7):
        bench.send(data[start : start + 7])
    bench.wait_for(2)
    bench.send(sample(3)[9:])
    assert len(bench.wait_for(3)) == 3
    values = bench.values()
    assert values["bytes_skipped"] == "22"
    assert int(values["crc_errors"]) >= 1


def test_diagnostics_count_what_was_lost_and_who_is_unknown(bench):
    bench = bench()
    bench.send(sample(0), sample(4), sample(4), sample(0, 99), sample(0, 6))
    bench.wait_for(1, "left_thigh")
    values = bench.values()
    assert values["port"] == "open"
    assert values["torso.lost"] == "3"
    assert values["torso.duplicates"] == "1"
    assert values["left_thigh.lost"] == "0"
    assert values["unknown_nodes"] == "99: 1"
    assert values["frames"] == "5"


def test_diagnostics_name_a_silent_node(bench):
    bench = bench()
    sent = 0

    def torso_only() -> bool:
        nonlocal sent
        bench.send(sample(sent))
        sent += 1
        return bool(bench.diagnostics) and bench.diagnostics[-1].status[0].message == (
            "silent nodes: left_thigh"
        )

    bench.spin_until(torso_only, "the silent node to be named")


def test_a_lost_port_is_logged_once(bench, ros_context):
    logged = ros_context.collect(Log, "/rosout")
    bench = bench()
    bench.send(sample(0))
    bench.wait_for(1)
    bench.close()

    bench.spin_until(lambda: bench.values().get("port") == "lost, trying to reopen")
    reports = len(bench.diagnostics)
    bench.spin_until(lambda: len(bench.diagnostics) > reports + 1, what="further reports")
    said = [log.msg for log in logged if log.name == "imu_bridge"]
    assert said == ["the port was lost: trying to reopen it"]


def test_a_port_that_does_not_exist_is_an_error(bench):
    with pytest.raises(InputError, match="cannot open port '/dev/none'"):
        bench(port="/dev/none")


def test_a_missing_nodes_file_is_an_error(bench, tmp_path: Path):
    with pytest.raises(InputError, match="cannot read the nodes file"):
        bench(nodes_file=str(tmp_path / "none.yaml"))


def test_no_nodes_file_is_an_error(bench):
    with pytest.raises(ParameterError, match="nodes_file is not set"):
        bench(nodes_file="")


def test_a_parameter_outside_its_range_is_an_error(bench):
    with pytest.raises(ParameterError, match=r"beta.*\[0, 10\]"):
        bench(beta=-0.1)


@pytest.mark.parametrize("value", ["off", False])  # YAML reads off as false
def test_with_the_magnetometer_off_the_heading_is_published_as_unknown(bench, value):
    bench = bench(magnetometer=value)
    bench.send(sample(0))
    (data,) = bench.wait_for(1)
    assert data.orientation_covariance[8] == pytest.approx(np.pi**2)
    assert len(bench.wait_for(1, name="mag")) == 1


@pytest.mark.parametrize("name", FILTERS)
def test_every_filter_can_be_chosen(bench, name: str):
    bench = bench(filter=name)
    bench.send(sample(0), sample(1))
    assert len(bench.wait_for(2, name="data_raw")) == 2
    assert len(bench.wait_for(0 if name == "device" else 2)) == (0 if name == "device" else 2)


def test_an_unknown_filter_is_an_error(bench):
    with pytest.raises(ParameterError, match=r"filter = 'kalman' is not one of vqf, madgwick"):
        bench(filter="kalman")
