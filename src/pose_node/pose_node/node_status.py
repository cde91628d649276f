"""A node's report in ``/diagnostics``, as it is made and as it arrives."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """Levels of a node's health: the values of ``diagnostic_msgs/DiagnosticStatus``."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, kw_only=True)
class Report:
    """State of a node: a level, a sentence, and values such as counters."""

    level: Level
    message: str
    values: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class NodeStatus:
    """The last report of a node."""

    name: str  # fully qualified
    level: Level = Level.OK
    message: str = ""
    values: Mapping[str, str] = field(default_factory=dict)
    received_ns: int = 0  # [ns] since 1970

    def count(self, name: str) -> int:
        """Value of a counter; 0 if there is none of that name."""
        text = self.values.get(name, "0")
        return int(text) if text.lstrip("-").isdigit() else 0
