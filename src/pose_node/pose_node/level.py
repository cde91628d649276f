"""Levels of a node's health, as in ``/diagnostics``."""

from enum import IntEnum


class Level(IntEnum):
    """The values of ``diagnostic_msgs/DiagnosticStatus``."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3
