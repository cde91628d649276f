"""Protocols of IMUs: one module each, without input or output.

A new protocol needs a module with a :class:`~imu_bridge.protocols.reading.Parser` and a line in
:data:`PROTOCOLS`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from imu_bridge.protocols.reading import Parser
from imu_bridge.protocols.star import StarParser
from imu_bridge.protocols.text import TextParser, line_format
from imu_bridge.protocols.witmotion import WitMotionParser


@dataclass(frozen=True, kw_only=True)
class ProtocolEntry:
    """Entry of a protocol."""

    make_parser: Callable[[Mapping[str, Any]], Parser]  # from a port's options in the nodes file
    baudrates: tuple[int, ...]  # [bit/s] of such devices, most common first
    options: tuple[str, ...] = ()  # names of the accepted options


PROTOCOLS: dict[str, ProtocolEntry] = {
    "star": ProtocolEntry(make_parser=lambda _: StarParser(), baudrates=(921600, 460800, 115200)),
    "witmotion": ProtocolEntry(
        make_parser=lambda _: WitMotionParser(), baudrates=(115200, 9600, 921600, 230400)
    ),
    "text": ProtocolEntry(
        make_parser=lambda options: TextParser(line_format(options)),
        baudrates=(115200, 57600, 9600, 38400),
        options=("fields", "units", "prefix"),
    ),
}
"""Protocols by their name in the nodes file."""
