"""The reading thread, on pseudo-terminals and sockets."""

import os
import socket
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from patience import wait_until

from imu_bridge.serial_source import PortState, SerialSource
from pose_core.errors import InputError


class Device:
    """A pseudo-terminal behind a link, as a plugged-in sink."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.master, slave = os.openpty()
        self._open: tuple[int, ...] = (self.master, slave)
        tty.setraw(slave)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(slave))

    def send(self, data: bytes) -> None:
        os.write(self.master, data)

    def unplug(self) -> None:
        self.link.unlink(missing_ok=True)
        for descriptor in self._open:
            os.close(descriptor)
        self._open = ()


@pytest.fixture
def device(tmp_path: Path) -> Iterator[Device]:
    device = Device(tmp_path / "sink")
    yield device
    device.unplug()


@pytest.fixture
def open_source() -> Iterator[Callable[..., SerialSource]]:
    sources = []

    def make(port: object, **options) -> SerialSource:
        options = {"clock": time.time_ns, "notify": lambda: None, **options}
        sources.append(SerialSource(str(port), 115200, **options))
        return sources[-1]

    yield make
    for source in sources:
        source.close()


def receive(source: SerialSource, count: int) -> bytes:
    received = b""

    def enough() -> bool:
        nonlocal received
        received += b"".join(chunk.data for chunk in source.take())
        return len(received) >= count

    wait_until(enough)
    return received


def test_bytes_arrive_whole_and_stamped(device: Device, open_source):
    source = open_source(device.link, clock=lambda: 1234)
    device.send(bytes(range(256)))
    chunks = []
    wait_until(lambda: chunks.extend(source.take()) or sum(len(c.data) for c in chunks) == 256)
    assert b"".join(chunk.data for chunk in chunks) == bytes(range(256))
    assert {chunk.arrival_ns for chunk in chunks} == {1234}
    assert source.counters["bytes"] == 256


def test_arrival_is_notified(device: Device, open_source):
    notified = []
    source = open_source(device.link, notify=lambda: notified.append(True))
    wait_until(lambda: source.state is PortState.OPEN)
    before = len(notified)
    device.send(b"x")
    wait_until(lambda: len(notified) > before)
    assert source.take()[0].data == b"x"


def test_a_missing_port_is_refused_at_once(open_source, tmp_path: Path):
    with pytest.raises(InputError, match=r"cannot open port '.*none': No such file.*ports found: "):
        open_source(tmp_path / "none")


def test_a_file_is_no_port(open_source, tmp_path: Path):
    path = tmp_path / "file"
    path.write_bytes(b"not a port")
    with pytest.raises(InputError, match="cannot open port"):
        open_source(path)


def test_an_unknown_scheme_is_refused(open_source):
    with pytest.raises(InputError, match="protocol 'foo' not known"):
        open_source("foo://bar")


def test_a_port_that_another_reader_has_is_refused(device: Device, open_source):
    open_source(device.link)
    with pytest.raises(InputError, match="cannot open port"):
        open_source(device.link)


def test_a_port_is_waited_for(open_source, tmp_path: Path):
    link = tmp_path / "later"
    source = open_source(link, wait_s=60.0)
    assert source.state is PortState.WAITING
    device = Device(link)
    device_bytes = b"here at last"
    wait_until(lambda: source.state is PortState.OPEN)
    device.send(device_bytes)
    assert receive(source, len(device_bytes)) == device_bytes
    device.unplug()


def test_a_port_that_never_comes_is_an_error(open_source, tmp_path: Path):
    source = open_source(tmp_path / "never", wait_s=0.2)
    wait_until(lambda: source.state is PortState.FAILED)
    with pytest.raises(InputError, match=r"never.*waited 0\.2 s"):
        source.take()


def test_a_port_that_vanishes_is_reopened_when_it_is_back(device: Device, open_source):
    source = open_source(device.link)
    device.send(b"before")
    assert receive(source, 6) == b"before"
    device.unplug()
    wait_until(lambda: source.state is PortState.LOST)
    assert [chunk.data for chunk in source.take()] == [b""]  # the stream is cut here
    back = Device(device.link)
    wait_until(lambda: source.state is PortState.OPEN)
    back.send(b"after")
    assert receive(source, 5) == b"after"
    assert source.counters["port_losses"] == 1
    back.unplug()


def test_closing_ends_the_thread_even_while_the_port_is_lost(device: Device, open_source):
    source = open_source(device.link)
    device.unplug()
    wait_until(lambda: source.state is PortState.LOST)
    source.close()
    assert source.state is PortState.CLOSED


def test_bytes_that_are_not_read_are_counted(device: Device, open_source, monkeypatch):
    monkeypatch.setattr("imu_bridge.serial_source.QUEUE_CHUNKS", 1)
    source = open_source(device.link)
    device.send(b"first")
    wait_until(lambda: source.counters["bytes"] == 5)
    device.send(b"second")
    wait_until(lambda: source.counters["chunks_dropped"] == 1)
    assert receive(source, 5) == b"first"


def test_a_network_port_is_read(open_source):
    with socket.create_server(("127.0.0.1", 0)) as server:
        source = open_source(f"socket://127.0.0.1:{server.getsockname()[1]}")
        connection, _ = server.accept()
        with connection:
            connection.sendall(b"over the network")
            assert receive(source, 16) == b"over the network"
        wait_until(lambda: source.state is PortState.LOST)
