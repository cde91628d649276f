"""Runs the live graph with the synthetic subject's devices and the viewer."""

import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pose_node.child_process import executable

NS_PER_S = 1_000_000_000
LEAD_S = 40.0  # [s] to generate the session, start the graph and load the page


@dataclass(frozen=True, kw_only=True)
class Session:
    """Motion of the synthetic subject."""

    choreography: str
    seed: int
    duration_s: float


@dataclass(frozen=True, kw_only=True)
class ViewedGraph:
    """A running graph with its page.

    Attributes:
        process: The launcher.
        address: Address of the page.
        start_at_ns: Start of the session [ns since 1970].
        bag: The bag being recorded.
    """

    process: "subprocess.Popen[str]"
    address: str
    start_at_ns: int
    bag: Path

    def left_s(self, session_s: float) -> float:
        """Time until an instant of the session [s], at least 0."""
        return max(0.0, self.start_at_ns / NS_PER_S + session_s - time.time())


@contextmanager
def viewed_graph(session: Session, folder: Path, *arguments: str) -> Iterator[ViewedGraph]:
    """Generate the session, start its devices and the graph with the page; stop them at the end.

    Args:
        session: Motion of the subject.
        folder: Folder for the session and the bag.
        *arguments: Further arguments of the launch file, as ``name:=value``.
    """
    start_at_ns = time.time_ns() + round(LEAD_S * NS_PER_S)
    words: Sequence[str | Path] = [
        executable("pose_sim", "generate"),
        *("--choreography", session.choreography, "--duration", str(session.duration_s)),
        *("--seed", str(session.seed), "--start-at", str(start_at_ns), "-o", folder / "session"),
    ]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    launch: Sequence[str | Path] = [
        executable("pose_launch", "up"),
        "--keep-running",
        "demo.launch.yaml",
        f"session:={folder / 'session'}",
        f"start_at:={start_at_ns}",
        f"bag:={folder / 'bag'}",
        "view:=true",
        "page_port:=0",
        *arguments,
    ]
    with serving(launch) as (process, address):
        yield ViewedGraph(
            process=process, address=address, start_at_ns=start_at_ns, bag=folder / "bag"
        )


@contextmanager
def serving(command: Sequence[str | Path]) -> "Iterator[tuple[subprocess.Popen[str], str]]":
    """Run a process that serves the page; yields it and the address, interrupts it at the end."""
    with subprocess.Popen(
        list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                if found := re.search(r"http://127\.0\.0\.1:\d+", line):
                    # Its output must be read, otherwise the full pipe blocks it.
                    threading.Thread(target=process.stdout.read, daemon=True).start()
                    yield process, found[0]
                    break
            else:
                sys.exit(f"error: {command[0]} ended without a page")
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()
