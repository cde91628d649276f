"""``./pose calibrate``: runs the tool named by the first argument; without a name, that for a bag.

Only the selected tool is imported: all of them together take seconds to load.
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
