"""The nodes file: sensors with their ports, protocols and segments."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from imu_bridge.protocols import PROTOCOLS
from imu_bridge.protocols.reading import Parser
from imu_bridge.segments import (
    NODE_KEYS,
    ImuNode,
    mapping,
    node_of,
    nodes_of,
    refuse_double_segments,
)
from pose_core.errors import InputError
from pose_core.plain_yaml import read_yaml


@dataclass(frozen=True, kw_only=True)
class PortConfig:
    """Configuration of one port."""

    name: str  # device path or pyserial URL
    protocol: str = "star"  # a key of PROTOCOLS
    baudrate: int = 921600  # [bit/s]
    options: Mapping[str, Any] = field(default_factory=dict)  # of the protocol

    def make_parser(self) -> Parser:
        """A new parser for this port."""
        return PROTOCOLS[self.protocol].make_parser(self.options)


@dataclass(frozen=True, kw_only=True)
class Devices:
    """All ports and their nodes."""

    ports: tuple[PortConfig, ...]
    nodes: tuple[ImuNode, ...]


def read_devices(path: Path, sink: PortConfig) -> Devices:
    """Read a nodes file.

    Args:
        path: The file.
        sink: The port of the star network, whose nodes are at the file's top level.

    Raises:
        InputError: If the file cannot be read or is invalid.
    """
    document = read_yaml(path, "the nodes file")
    with errors_of(path):
        return parse_devices(document, sink)


def parse_devices(document: Any, sink: PortConfig) -> Devices:
    """The devices from a nodes file's content, see :func:`read_devices`.

    Raises:
        InputError: If the content is invalid.
    """
    top = mapping(document, "the file", {"nodes", "ports"})
    ports: list[PortConfig] = []
    nodes: list[ImuNode] = []
    if "nodes" in top or "ports" not in top:
        ports.append(sink)
        nodes += nodes_of(top.get("nodes"), 0)
    if "ports" in top:
        entries = top["ports"]
        if not isinstance(entries, Mapping) or not entries:
            raise InputError("expected a mapping 'ports' of device to protocol and segment")
        for name, entry in entries.items():
            nodes += _port_nodes(str(name), entry, len(ports))
            ports.append(_port(str(name), entry))
    names = [port.name for port in ports]
    if len(set(names)) < len(names):
        raise InputError(f"port '{sink.name}' is also that of the star network: name it once")
    refuse_double_segments(nodes, names)
    return Devices(ports=tuple(ports), nodes=tuple(nodes))


def _port(name: str, entry: Mapping[str, Any]) -> PortConfig:
    protocol = entry["protocol"]
    known = PROTOCOLS[protocol]
    baudrate = entry.get("baudrate", known.baudrates[0])
    if type(baudrate) is not int or baudrate <= 0:
        raise InputError(f"{name}: baudrate = {baudrate!r} is not an integer [bit/s]")
    options = {key: entry[key] for key in known.options if key in entry}
    config = PortConfig(name=name, protocol=protocol, baudrate=baudrate, options=options)
    with errors_of(name):
        config.make_parser()
    return config


def _port_nodes(name: str, entry: Any, port: int) -> list[ImuNode]:
    """The nodes of a port: by id, or the single one of the segment in the port's entry."""
    protocol = entry.get("protocol") if isinstance(entry, Mapping) else None
    if not isinstance(protocol, str) or protocol not in PROTOCOLS:
        raise InputError(f"{name}: protocol {protocol!r} is not one of {', '.join(PROTOCOLS)}")
    keys = {"protocol", "baudrate", "nodes", *NODE_KEYS, *PROTOCOLS[protocol].options}
    mapping(entry, name, keys)
    with errors_of(name):
        if "nodes" in entry:
            return nodes_of(entry["nodes"], port)
        return [node_of(0, {key: entry[key] for key in NODE_KEYS if key in entry}, port)]


@contextmanager
def errors_of(where: object) -> Iterator[None]:
    """Context manager that puts the file or port into the message of an :class:`InputError`."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
