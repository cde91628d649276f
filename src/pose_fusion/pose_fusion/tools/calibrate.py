"""``./pose calibrate``: runs the tool named by the first argument; without a name, that for a bag.

Only the selected tool is imported: all of them together take seconds to load.
"""

import sys
from importlib import import_module

from pose_node.command_line import run_tool

SUBCOMMANDS = ("board", "imu", "live")
BAG = "bag"
ROS_ARGS = "--ros-args"


def dispatch() -> None:
    """Run the tool."""
    arguments = [*sys.argv[1:], ROS_ARGS]
    arguments = arguments[: arguments.index(ROS_ARGS)]  # the rest is for ROS, which reads it itself
    name, *rest = arguments or [""]
    if name not in SUBCOMMANDS:
        name, rest = BAG, arguments
    import_module(f"pose_fusion.tools.calibrate_{name}").main(rest)


def main() -> None:
    """Run the tool and exit."""
    run_tool(dispatch)
