"""The processes of the demo: tools, the graph, the monitor."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

from pose_core.errors import InputError, PoseError
from pose_node.child_process import end_with_parent

OUR_NODE = re.compile(r"/lib/(?:kinect_bridge|imu_bridge|pose_fusion)/\S+ .*--ros-args")
STOP_S = 20.0  # [s] longer than the launcher needs to kill hanging processes


class GraphError(PoseError):
    """The live graph failed."""


def executable(package: str, name: str) -> Path:
    """The executable that ``ros2 run PACKAGE NAME`` finds.

    Raises:
        InputError: If it is not installed.
    """
    try:
        path = Path(get_package_prefix(package)) / "lib" / package / name
    except (PackageNotFoundError, ValueError) as error:
        raise InputError(f"package '{package}' is not installed: build the workspace") from error
    if not path.is_file():
        raise InputError(f"package '{package}' has no executable '{name}': build the workspace")
    return path


def start(command: Sequence[str | Path], **options: object) -> "subprocess.Popen[str]":
    """Start a process that does not receive the terminal's Ctrl-C and ends with this process."""
    return subprocess.Popen(  # type: ignore[call-overload]
        [str(word) for word in command],
        stdin=subprocess.DEVNULL,
        text=True,
        errors="replace",
        start_new_session=True,
        preexec_fn=end_with_parent(),
        **options,
    )


def stop(process: "subprocess.Popen[str]", patience_s: float = STOP_S) -> int:
    """Interrupt a process, and kill it if it does not end; returns its exit code."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        return process.wait(patience_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return process.wait()


def run_to_end(command: Sequence[str | Path]) -> str:
    """Run a tool to its end; returns its output.

    Raises:
        InputError: If it failed, with its own last line.
    """
    process = start(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        output, errors = process.communicate()
    except BaseException:
        stop(process)
        raise
    if process.returncode != 0:
        raise InputError(_last_error(errors) or f"{Path(command[0]).name} failed")
    return str(output)


@dataclass
class NodeStatus:
    """The last report of a node."""

    level: int = 0
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)

    def count(self, name: str) -> int:
        """Value of a counter; 0 if there is none of that name."""
        text = self.values.get(name, "0")
        return int(text) if text.lstrip("-").isdigit() else 0


class Monitor:
    """Monitors ``/diagnostics`` in another process; :attr:`nodes` is always current."""

    def __init__(self) -> None:
        self.nodes: dict[str, NodeStatus] = {}
        self.is_ready = threading.Event()
        self._process = start(
            [sys.executable, "-m", "pose_fusion.nodes.monitor"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
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
            status = NodeStatus(content["level"], content["message"], content["values"])
            # A new dict, so that other threads can iterate over the old one.
            self.nodes = {**self.nodes, content["name"]: status}


class LiveGraph:
    """A launch file run by ``up``, from entering the ``with`` block until :meth:`stop`.

    Args:
        launch_file: Its name or path.
        arguments: The file's arguments.
        log: File for the output of all nodes.
    """

    def __init__(self, launch_file: str, arguments: dict[str, str], log: Path) -> None:
        self._command: list[str | Path] = [
            executable("pose_launch", "up"),
            "--keep-running",
            launch_file,
            *(f"{name}:={value}" for name, value in arguments.items()),
        ]
        self._log = log
        self._process: subprocess.Popen[str] | None = None
        self.monitor: Monitor | None = None

    def __enter__(self) -> "LiveGraph":
        self.monitor = Monitor()
        try:
            with self._log.open("w") as output:
                self._process = start(self._command, stdout=output, stderr=subprocess.STDOUT)
        except BaseException:
            self.monitor.stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        # The processes must end, also if Ctrl-C is pressed again.
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            self._stop_all()
        finally:
            signal.signal(signal.SIGINT, before)

    @property
    def pid(self) -> int:
        """The launcher's process."""
        assert self._process is not None
        return self._process.pid

    @property
    def nodes(self) -> dict[str, NodeStatus]:
        """The last report of each node."""
        return self.monitor.nodes if self.monitor else {}

    def planned_nodes(self) -> list[str]:
        """Names of the graph's nodes that report to ``/diagnostics``: those of this project."""
        lines = run_to_end([*self._command, "--print"]).splitlines()
        return [line.split(":")[0] for line in lines if OUR_NODE.search(line)]

    def check(self) -> None:
        """Check that the graph runs.

        Raises:
            GraphError: If it has ended, or a process of it has died.
        """
        assert self._process is not None
        text = self._log.read_text(errors="replace")
        if self._process.poll() is not None or " has died (" in text:
            raise self._error("the graph failed", text)

    def stop(self) -> None:
        """Stop the graph.

        Raises:
            GraphError: If a process had to be killed or ended with an error.
        """
        self.check()
        if self._stop_all() != 0:
            text = self._log.read_text(errors="replace")
            raise self._error("the graph did not stop cleanly", text)

    def finish(self) -> None:
        """Stop a graph whose processes may have died already."""
        self._stop_all()

    def _stop_all(self) -> int:
        code = stop(self._process) if self._process else 0
        if self.monitor:
            self.monitor.stop()
        return code

    def _error(self, what: str, text: str) -> GraphError:
        """Create an error with the best line: an error, a failed process, or the last."""
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        marks = ("error: ", "Error: ", " has died (", "failed: ")
        marked = [line for mark in marks for line in lines if mark in line] or lines[-1:]
        why = marked[0] if marked else "it said nothing"
        return GraphError(f"{what}: {why} (all its output: {self._log})")


@dataclass(frozen=True, kw_only=True)
class DemoRun:
    """A finished run of the graph."""

    folder: Path
    subject: str  # description of the subject
    nodes: Mapping[str, NodeStatus]  # the last report of each node

    @property
    def bag(self) -> Path:
        """The recorded bag."""
        return self.folder / "bag"


def _last_error(errors: str) -> str:
    lines = [line.strip() for line in errors.splitlines() if line.strip()]
    return lines[-1].removeprefix("error: ") if lines else ""
