"""``./pose top``: topics, rates, latencies and warnings, live in the terminal."""

import argparse
import sys
import time
from functools import partial
from typing import Any

from rclpy.executors import ExternalShutdownException
from rclpy.utilities import remove_ros_args
from rich.console import Console
from rich.live import Live

from pose_fusion.nodes.listener import GraphListener
from pose_fusion.watching.terminal import page
from pose_node.command_line import add_flag, add_option, number_within
from pose_node.nodes.running import run_node

PERIOD_S = 0.5  # [s] between pages
LISTEN_S = 3.0  # [s] before the one page of --once
MIN_DURATION_S, MAX_DURATION_S = 0.5, 600.0  # [s] a rate needs some time
PLAIN_WIDTH = 80  # [columns] without a terminal


class TopNode(GraphListener):
    """Shows a page twice a second, or one page after a while.

    Args:
        console: The output.
        once_after_s: Show one page after this time [s], then end; None: run until Ctrl-C.
    """

    def __init__(self, console: Console, once_after_s: float | None, **options: Any) -> None:
        super().__init__("top", **options)
        self._console = console
        self._live: Live | None = None
        if once_after_s is not None:
            self.create_timer(once_after_s, self._show_once)
            return
        self._live = Live(console=console, auto_refresh=False, screen=True)
        self._live.start()
        self.create_timer(PERIOD_S, partial(self._refresh, self._live))

    def _refresh(self, live: Live) -> None:
        height = self._console.size.height
        live.update(page(self.snapshot(), time.strftime("%H:%M:%S"), height), refresh=True)

    def _show_once(self) -> None:
        snapshot = self.snapshot()
        lines = max(self._console.size.height, 24 + len(snapshot.statuses))
        self._console.print(page(snapshot, time.strftime("%H:%M:%S"), lines))
        raise ExternalShutdownException

    def destroy_node(self) -> None:
        """Restore the terminal."""
        if self._live is not None:
            self._live.stop()
        super().destroy_node()


def parse_arguments(words: list[str]) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        prog="pose top",
        description="Show the topics of the graph live: rates, latencies, tracking, warnings. "
        "Ctrl-C ends it.",
    )
    page = "print one page and end, for scripts; so it does where there is no terminal"
    add_flag(parser, "--once", page)
    within = number_within(MIN_DURATION_S, MAX_DURATION_S, "s")
    add_option(parser, "--listen", LISTEN_S, "how long --once listens first [s]", "S", type=within)
    return parser.parse_args(words)


def main() -> None:
    """Run the node."""
    options = parse_arguments(remove_ros_args(sys.argv)[1:])
    terminal = sys.stdout.isatty()
    console = Console(width=None if terminal else PLAIN_WIDTH, highlight=False)
    once_after_s = options.listen if options.once or not terminal else None
    run_node(lambda: TopNode(console, once_after_s))
