"""Which processes of a graph end by themselves, so that ``up`` ends with them."""

import pytest

from pose_launch.processes import Process
from pose_launch.up import _ends_by_itself


@pytest.mark.parametrize(
    ("values", "ends"),
    [
        ({"exit_at_end": True}, True),
        ({"exit_at_end": True, "source": "file"}, True),
        ({"exit_at_end": True, "loop": True}, False),
        ({"exit_at_end": True, "source": "udp"}, False),
        ({"exit_at_end": False}, False),
    ],
)
def test_only_a_replay_that_exits_at_its_end_ends_by_itself(values, ends):
    process = Process(name="left", command=("replay",), parameters=(values,))
    assert _ends_by_itself(process) is ends
