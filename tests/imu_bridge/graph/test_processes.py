"""The bridge as a real process on pseudo-terminals: many nodes, unplugged, wrong speed."""

import os
import sys
import threading
import time
import tty
from collections import Counter
from pathlib import Path

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu

from imu_bridge.protocols.star import RawSample, encode
from pose_core.joints import SEGMENTS
from pose_sim.serial_device import PseudoTerminal
from pose_sim.witmotion_device import packets

pytestmark = pytest.mark.graph

CONFIG = Path(__file__).parents[3] / "src" / "imu_bridge" / "config"
NODES = 17  # of which two are on segments that nobody has named
PORTS = 15
PERIOD_S = 0.01
FRAMES = 300  # of each node
HALF_FULL = 2048  # [bytes] of the 4096 that a terminal holds


def executable() -> Path:
    for prefix in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep):
        path = Path(prefix) / "lib" / "imu_bridge" / "imu_bridge"
        if path.exists():
            return path
    raise AssertionError("imu_bridge has no executable")


def command(port: object, **parameters) -> list:
    values = {"port": port, "nodes_file": CONFIG / "imu_nodes.yaml", **parameters}
    return [
        *(sys.executable, executable(), "--ros-args"),
        *(word for name, value in values.items() for word in ("-p", f"{name}:={value}")),
    ]


class Sink:
    """A pseudo-terminal behind a link, with nine nodes that send when they are told to."""

    def __init__(self, link: Path) -> None:
        self._link = link
        self._sequence = 0
        self.plug()

    def plug(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self._link.symlink_to(os.ttyname(self._slave))

    def unplug(self) -> None:
        self._link.unlink()
        os.close(self._master)
        os.close(self._slave)

    def send_round(self) -> None:
        k = self._sequence
        self._sequence += 1
        for node_id in range(1, NODES + 1):
            sample = RawSample(
                node_id=node_id,
                sequence=k,
                clock_us=k * 10_000 + node_id * 1000,
                accelerometer=(0, 0, 16384),
                gyroscope=(0, 0, 0),
                magnetometer=(0, 80, -160),
                magnetometer_valid=True,
            )
            os.write(self._master, encode(sample))


@pytest.fixture
def sink(tmp_path: Path):
    sink = Sink(tmp_path / "sink")
    yield sink
    sink.unplug()


class Watch:
    """What the bridge publishes and says of itself."""

    def __init__(self, ros_context) -> None:
        self._node = ros_context.make_node()
        self.samples: Counter[str] = Counter()
        self.values: dict[str, str] = {}
        self.message = ""
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_status, 10)
        self._node.create_subscription(
            Imu, "imu_torso/data", lambda _: self.samples.update(torso=1), qos_profile_sensor_data
        )

    def _on_status(self, array: DiagnosticArray) -> None:
        (status,) = array.status
        self.message = status.message
        self.values = {item.key: item.value for item in status.values}


def every_period(send, rounds: int) -> threading.Thread:
    """Call ``send`` at 100 Hz from a thread; held up, it does not catch up in a rush."""

    def run() -> None:
        due = time.monotonic()
        for _ in range(rounds):
            send()
            due = max(due + PERIOD_S, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


def write_nodes(folder: Path, content: dict) -> Path:
    path = folder / "nodes.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_seventeen_nodes_at_100_hz_lose_nothing(
    start_process, ros_context, spin_until, sink, tmp_path
):
    watch = Watch(ros_context)
    nodes = write_nodes(tmp_path, {"nodes": dict(enumerate(SEGMENTS, 1))})
    bridge = start_process(command(sink._link, nodes_file=nodes))
    spin_until(lambda: watch.values.get("port") == "open", what="the port")

    sender = every_period(sink.send_round, FRAMES)
    spin_until(
        lambda: watch.values["frames"] == str(NODES * FRAMES), what="all frames to be counted"
    )
    sender.join()

    lost = {name: v for name, v in watch.values.items() if name.endswith(".lost")}
    assert len(lost) == len(SEGMENTS)
    assert set(lost.values()) == {"0"}
    assert watch.values["unknown_nodes"] == f"16: {FRAMES}, 17: {FRAMES}"
    assert watch.values["crc_errors"] == watch.values["bytes_skipped"] == "0"
    assert watch.values["chunks_dropped"] == "0"
    assert watch.samples["torso"] > 0
    assert bridge.stop() == 0
    assert "Traceback" not in bridge.output


class WitMotionSensors:
    """One emulated sensor a port, each behind a link of its own."""

    def __init__(self, folder: Path, count: int) -> None:
        self.links = [folder / f"wit_{segment}" for segment in SEGMENTS[:count]]
        self.terminals = [PseudoTerminal(link, 115200) for link in self.links]
        self._data = packets(acceleration=[0, 0, 9.8], angular_velocity=[0, 0, 0])

    def nodes(self, baudrate: int = 115200) -> dict:
        entry = {"protocol": "witmotion", "baudrate": baudrate}
        named = zip(self.links, SEGMENTS, strict=False)
        return {"ports": {str(link): {**entry, "segment": segment} for link, segment in named}}

    def send_round(self) -> None:
        for terminal in self.terminals:
            terminal.write(self._data)

    def send_round_once_read(self) -> None:
        """Send when there is room: what a terminal cannot hold is lost."""
        while any(terminal.unread() > HALF_FULL for terminal in self.terminals):
            time.sleep(PERIOD_S)
        self.send_round()

    def close(self) -> None:
        for terminal in self.terminals:
            terminal.close()


@pytest.fixture
def sensors(tmp_path: Path):
    made = []

    def make(count: int) -> WitMotionSensors:
        made.append(WitMotionSensors(tmp_path, count))
        return made[-1]

    yield make
    for each in made:
        each.close()


def test_sensors_on_fifteen_ports_at_100_hz_lose_nothing(
    start_process, ros_context, spin_until, sensors, tmp_path
):
    watch, devices = Watch(ros_context), sensors(PORTS)
    bridge = start_process(command("none", nodes_file=write_nodes(tmp_path, devices.nodes())))
    ports = [f"{link}.port" for link in devices.links]
    spin_until(lambda: all(watch.values.get(port) == "open" for port in ports), what="ports")

    sender = every_period(devices.send_round_once_read, FRAMES)
    packets_sent = str(3 * FRAMES)
    spin_until(
        lambda: all(watch.values[f"{link}.frames"] == packets_sent for link in devices.links),
        what="all packets to be counted",
    )
    sender.join()

    for segment in SEGMENTS[:PORTS]:
        # How many packets make a sample is known from the second one on.
        assert watch.values[f"{segment}.frames"] == str(FRAMES)
    assert {watch.values[f"{link}.bytes_skipped"] for link in devices.links} == {"0"}
    assert bridge.stop() == 0
    assert "Traceback" not in bridge.output


def test_another_speed_than_the_sensors_is_named_with_those_to_try(
    start_process, ros_context, spin_until, sensors, tmp_path
):
    watch, devices = Watch(ros_context), sensors(1)
    nodes = write_nodes(tmp_path, devices.nodes(baudrate=9600))
    bridge = start_process(command("none", nodes_file=nodes))

    def named() -> bool:
        devices.send_round()
        return "no valid witmotion packet" in watch.message

    spin_until(named, what="the wrong speed to be reported")
    assert "is the baud rate 9600 right? try 115200, 921600, 230400" in watch.message
    assert bridge.stop() == 0


def test_one_of_two_sensors_unplugged_leaves_the_other_and_comes_back(
    start_process, ros_context, spin_until, sensors, tmp_path
):
    watch, devices = Watch(ros_context), sensors(2)
    torso = SEGMENTS.index("torso")
    other = devices.links[1 - torso]
    bridge = start_process(command("none", nodes_file=write_nodes(tmp_path, devices.nodes())))

    def samples_arrive() -> bool:
        devices.send_round()
        return watch.samples["torso"] > 0

    spin_until(samples_arrive, what="samples")
    unplugged = devices.terminals.pop(1 - torso)
    unplugged.close()
    spin_until(lambda: f"{other}: the port was lost" in watch.message, what="the loss")
    watch.samples.clear()
    spin_until(samples_arrive, what="the other sensor's samples")
    devices.terminals.insert(1 - torso, PseudoTerminal(other, 115200))
    spin_until(lambda: watch.values[f"{other}.port"] == "open", what="the port again")
    assert watch.values[f"{other}.port_losses"] == "1"
    assert bridge.stop() == 0


def test_an_unplugged_port_is_reported_and_used_again_when_it_is_back(
    start_process, ros_context, spin_until, sink
):
    watch = Watch(ros_context)
    bridge = start_process(command(sink._link))

    def samples_arrive() -> bool:
        sink.send_round()
        return watch.samples["torso"] > 0

    spin_until(samples_arrive, what="samples")
    sink.unplug()
    spin_until(lambda: "port was lost" in watch.message, what="the loss to be reported")
    sink.plug()
    spin_until(lambda: watch.values["port"] == "open", what="the port to be reopened")
    watch.samples.clear()
    spin_until(samples_arrive, what="samples again")
    assert watch.values["port_losses"] == "1"
    assert bridge.stop() == 0


def test_a_missing_port_ends_the_process_with_one_line(start_process, tmp_path):
    bridge = start_process(command(tmp_path / "none"))
    assert bridge.wait() == 1
    assert bridge.output.startswith("error: cannot open port")
    assert len(bridge.output.splitlines()) == 1


def test_a_port_that_is_waited_for_in_vain_ends_the_process_with_one_line(start_process, tmp_path):
    bridge = start_process(command(tmp_path / "none", wait_for_port=0.5))
    assert bridge.wait() == 1
    assert "waited 0.5 s" in bridge.output
    assert len(bridge.output.splitlines()) == 1


def test_waiting_for_a_port_can_be_interrupted(start_process, ros_context, spin_until, tmp_path):
    watch = Watch(ros_context)
    bridge = start_process(command(tmp_path / "none", wait_for_port=600.0))
    spin_until(lambda: "waiting for the port" in watch.message, what="the waiting")
    assert bridge.stop() == 0
    assert bridge.output == ""
