"""A launched graph as other programs see it: its processes and their ``/diagnostics``."""

import json
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

from pose_core.errors import PoseError
from pose_node.child_process import executable, run_to_end, start, stop
from pose_node.node_status import Level, NodeStatus

OUR_NODE = re.compile(r"/lib/(?:kinect_bridge|imu_bridge|pose_fusion)/\S+ .*--ros-args")


class GraphError(PoseError):
    """The live graph failed."""


class DiagnosticsReader:
    """Runs the monitor node in another process; :attr:`nodes` is always current."""

    def __init__(self) -> None:
        self.nodes: dict[str, NodeStatus] = {}
        self.is_ready = threading.Event()
        command = [sys.executable, "-m", "pose_fusion.nodes.monitor"]
        self._process = start(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def stop(self) -> None:
        """Stop the process."""
        stop(self._process)
        self._reader.join(timeout=2.0)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            content = json.loads(line)
            if "ready" in content:
                self.is_ready.set()
                continue
            status = NodeStatus(**content | {"level": Level(content["level"])})
            # A new dict, so that other threads can iterate over the old one.
            self.nodes = {**self.nodes, status.name: status}


def up_command(launch_file: str, arguments: Mapping[str, str]) -> list[str | Path]:
    """The command that starts a launch file with these arguments."""
    words = [f"{name}:={value}" for name, value in arguments.items()]
    return [executable("pose_launch", "up"), launch_file, *words]


def launch(command: Sequence[str | Path], log: Path) -> "subprocess.Popen[str]":
    """Start an :func:`up_command`; the output of all nodes goes to a file."""
    with log.open("w") as output:
        return start(command, stdout=output, stderr=subprocess.STDOUT)


class LaunchedGraph:
    """A launch file run by ``up`` and watched, from entering the ``with`` block until :meth:`stop`.

    Args:
        launch_file: Its name or path.
        arguments: The file's arguments.
        log: File for the output of all nodes.
    """

    def __init__(self, launch_file: str, arguments: dict[str, str], log: Path) -> None:
        self._command = [*up_command(launch_file, arguments), "--keep-running"]
        self._log = log

    def __enter__(self) -> "LaunchedGraph":
        self.monitor = DiagnosticsReader()
        try:
            self._process = launch(self._command, self._log)
        except BaseException:
            self.monitor.stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        # The processes must end, also if Ctrl-C is pressed again.
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            self.finish()
        finally:
            signal.signal(signal.SIGINT, before)

    @property
    def pid(self) -> int:
        """The launcher's process."""
        return self._process.pid

    @property
    def nodes(self) -> dict[str, NodeStatus]:
        """The last report of each node."""
        return self.monitor.nodes

    def planned_nodes(self) -> list[str]:
        """Names of the graph's nodes that report to ``/diagnostics``: those of this project."""
        lines = run_to_end([*self._command, "--print"]).splitlines()
        return [line.split(":")[0] for line in lines if OUR_NODE.search(line)]

    def check(self) -> None:
        """Check that the graph runs.

        Raises:
            GraphError: If it has ended, or a process of it has died.
        """
        text = self._log.read_text(errors="replace")
        if self._process.poll() is not None or " has died (" in text:
            raise self._error("the graph failed", text)

    def stop(self) -> None:
        """Stop the graph.

        Raises:
            GraphError: If a process had to be killed or ended with an error.
        """
        self.check()
        if self.finish() != 0:
            text = self._log.read_text(errors="replace")
            raise self._error("the graph did not stop cleanly", text)

    def finish(self) -> int:
        """Stop a graph whose processes may have died already; returns the launcher's status."""
        code = stop(self._process)
        self.monitor.stop()
        return code

    def _error(self, what: str, text: str) -> GraphError:
        """Create an error with the best line: an error, a failed process, or the last."""
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        marks = ("error: ", "Error: ", " has died (", "failed: ")
        marked = [line for mark in marks for line in lines if mark in line] or lines[-1:]
        why = marked[0] if marked else "it said nothing"
        return GraphError(f"{what}: {why} (all its output: {self._log})")
