"""Which processes of a graph are started again when they end."""

import pytest

from pose_launch.processes import Process
from pose_launch.supervising import STARTING_S, ProcessSupervisor

LONG_S, SHORT_S = 2.0 * STARTING_S, 0.5 * STARTING_S


@pytest.mark.parametrize(
    ("name", "code", "lived_s", "is_respawned"),
    [
        ("fusion", 0, LONG_S, True),  # somebody told it to end
        ("fusion", 1, LONG_S, True),
        ("fusion", -11, SHORT_S, True),  # it crashed
        ("fusion", 1, SHORT_S, False),  # it cannot start
        ("recording", 0, LONG_S, False),  # it is over
        ("recording", 1, LONG_S, True),
        ("no respawn", 1, LONG_S, False),
    ],
)
def test_what_is_started_again(name, code, lived_s, is_respawned):
    process = Process(name=name, command=("true",), respawn=name != "no respawn")
    supervisor = ProcessSupervisor([process], recordings=["recording"])
    (child,) = supervisor._children
    child.starts = 1
    assert supervisor._may_respawn(child, code, lived_s) is is_respawned
