"""How well a node does, as ``/diagnostics`` has it."""

from enum import IntEnum


class Level(IntEnum):
    """The values of ``diagnostic_msgs/DiagnosticStatus``."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3
