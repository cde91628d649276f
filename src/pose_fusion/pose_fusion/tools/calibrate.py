"""``./pose calibrate``: the tool that the first argument names; without a name, the one for a bag.

Each is imported only when it is wanted: all of them together take seconds to load, which a person
who waits to walk before the sensors should not have to.
"""

import sys
from importlib import import_module

from pose_node.command_line import run_tool

SUBCOMMANDS = ("board", "imu", "live")
BAG = "bag"


def dispatch() -> None:
    """Run the tool."""
    name, *rest = sys.argv[1:] or [""]
    if name not in SUBCOMMANDS:
        name, rest = BAG, sys.argv[1:]
    import_module(f"pose_fusion.tools.calibrate_{name}").main(rest)


def main() -> None:
    """Run the tool and exit."""
    run_tool(dispatch)
