"""Runs processes in parallel until all have ended or a stop is requested.

Each child has its own session and process group: it is interrupted once, by the launcher and not
by the terminal, together with its own children. If the launcher is killed, the kernel terminates
the children.

Built on asyncio's subprocesses, as ``ros2 launch`` is.
"""

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TextIO

from pose_launch.processes import Process
from pose_node.child_process import end_with_parent

RECOVERED_S = 10.0  # [s] lifetime after which the delay is reset
MAX_DELAY_S = 30.0  # [s]


STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
ESCALATION = ((signal.SIGINT, 5.0), (signal.SIGTERM, 5.0), (signal.SIGKILL, None))
"""Signals to stop a process, with time limits [s]; the same as of ``ros2 launch``."""
STOPPED = (0, -signal.SIGINT, 128 + signal.SIGINT, -signal.SIGTERM)
"""Exit codes of a process that was stopped."""
LAST_WORDS_S = 1.0  # [s] for output after the end of its process
STARTING_S = 5.0  # [s] lifetime below which a failure is a failed start
ENDING_S = 2.0  # [s] for processing the last frames of the recordings
CHUNK = 1 << 16  # [bytes] also the longest line that is not split
COLOURS = (36, 33, 32, 35, 34, 31)


class BackOff:
    """Restart delays that double after each failure, and are reset after a long lifetime.

    Args:
        first_s: The first delay [s].
    """

    def __init__(self, first_s: float) -> None:
        self._first_s = first_s
        self._next_s = first_s

    def delay_s(self, lived_s: float) -> float:
        """The delay [s] after a process that has run for ``lived_s`` [s]."""
        delay_s = self._first_s if lived_s >= RECOVERED_S else self._next_s
        self._next_s = max(self._first_s, min(2.0 * delay_s, MAX_DELAY_S))
        return delay_s


@dataclass
class _Child:
    """A process description and its running process, if any."""

    description: Process
    colour: int
    running: asyncio.subprocess.Process | None = None
    interrupted: bool = False  # ended by an unhandled KeyboardInterrupt
    last_line: str = ""  # of its output
    failures: list[str] = field(default_factory=list)
    starts: int = 0


class ProcessSupervisor:
    """Runs the processes of a graph.

    Args:
        processes: The processes to run.
        keep_going: Whether to keep the others running if a process fails at its start.
        recordings: Names of processes that end by themselves; when all have, the graph is stopped.
    """

    def __init__(
        self,
        processes: Sequence[Process],
        *,
        keep_going: bool = False,
        recordings: Collection[str] = (),
    ) -> None:
        self._recordings = set(recordings)
        self._keep_going = keep_going
        self._output: TextIO = sys.stdout  # of all, line by line, prefixed with their names
        self._coloured = self._output.isatty()
        self._children = [
            _Child(process, COLOURS[index % len(COLOURS)])
            for index, process in enumerate(processes)
        ]
        self._width = max((len(process.name) for process in processes), default=0)
        self._stopping = asyncio.Event()

    async def run(self) -> int:
        """Run all processes to their end.

        Returns:
            0 if nothing failed, 1 if a process ended with an error or had to be killed.
        """
        loop = asyncio.get_running_loop()
        for number in STOP_SIGNALS:
            loop.add_signal_handler(number, self._stop, f"{signal.Signals(number).name}: stopping")
        try:
            with TemporaryDirectory(prefix="pose_up_") as name:
                folder = Path(name)
                await asyncio.gather(*(self._supervise(c, folder) for c in self._children))
        finally:
            for number in STOP_SIGNALS:
                loop.remove_signal_handler(number)
                # A further Ctrl-C must not interrupt the orderly end.
                signal.signal(number, signal.SIG_IGN)
        failures = [failure for child in self._children for failure in child.failures]
        if failures:
            self._say(f"failed: {'; '.join(failures)}")
        return 1 if failures else 0

    # -- one process ----------------------------------------------------------------------------

    async def _supervise(self, child: _Child, folder: Path) -> None:
        process = child.description
        loop = asyncio.get_running_loop()
        back_off = BackOff(process.respawn_delay_s)
        while not self._stopping.is_set():
            begin_s = loop.time()
            child.starts += 1
            code, was_asked = await self._run_once(child, folder)
            if was_asked:
                if code not in STOPPED and not child.interrupted:
                    child.failures.append(f"{process.name} ({_describe(code)})")
                return
            lived_s = loop.time() - begin_s
            if not self._may_respawn(child, code, lived_s):
                await self._note_end(child, code, lived_s)
                return
            delay_s = back_off.delay_s(lived_s)
            self._say(f"{process.name} {_end_of(code)}: starting it again in {delay_s:g} s")
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._stopping.wait(), delay_s)

    def _may_respawn(self, child: _Child, code: int, lived_s: float) -> bool:
        """Whether to restart a process: not a finished recording, or one that failed at its start.

        As by ``ros2 launch``, others are restarted when they were told to end, too.
        """
        is_recording = child.description.name in self._recordings
        if not child.description.respawn or self._stopping.is_set() or (code == 0 and is_recording):
            return False
        has_started = child.starts > 1 or code < 0 or lived_s >= STARTING_S
        return has_started or self._keep_going

    async def _note_end(self, child: _Child, code: int, lived_s: float) -> None:
        """Report the end of a process; stop the others if required."""
        process = child.description
        has_failed_to_start = code != 0 and lived_s < STARTING_S
        why = f" at its start: {child.last_line}" if has_failed_to_start else ""
        self._say(f"{process.name} {_end_of(code)}{why}")
        if code != 0:
            child.failures.append(f"{process.name} ({_describe(code)})")
        if process.ends_graph:
            self._stop(f"{process.name} was required: stopping")
        elif has_failed_to_start and not self._keep_going and not self._stopping.is_set():
            self._stop("stopping the others: correct that, or let them run with --keep-going")
        elif code == 0 and process.name in self._recordings:
            self._recordings.discard(process.name)
            if not self._recordings and not self._stopping.is_set():
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self._stopping.wait(), ENDING_S)
                self._stop("every recording has ended: stopping (--keep-running stays)")

    async def _run_once(self, child: _Child, folder: Path) -> tuple[int, bool]:
        """Run the process to its end; returns its exit code, and whether it was told to stop."""
        process = child.description
        # Own pipe: with asyncio's, `wait` would wait for other processes that hold its end.
        reading, writing = os.pipe()
        relay = asyncio.create_task(self._relay(child, reading))
        try:
            running = await asyncio.create_subprocess_exec(
                *process.full_command(folder),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=writing,
                stderr=asyncio.subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
                start_new_session=True,
                preexec_fn=end_with_parent(),
            )
        except OSError as error:
            child.last_line = f"cannot start: {error}"
            self._say(f"{process.name} {child.last_line}")
            return 127, False
        finally:
            os.close(writing)
        child.running = running
        ending = asyncio.create_task(running.wait())
        asked = asyncio.create_task(self._stopping.wait())
        await asyncio.wait({ending, asked}, return_when=asyncio.FIRST_COMPLETED)
        asked.cancel()
        was_asked = not ending.done()
        if was_asked:
            await self._end(child, running, ending)
        await asyncio.wait({relay}, timeout=LAST_WORDS_S)
        # Remaining processes in its group.
        _signal_group(running.pid, signal.SIGKILL)
        relay.cancel()
        child.running = None
        return await ending, was_asked

    async def _end(
        self, child: _Child, running: asyncio.subprocess.Process, ending: "asyncio.Task[int]"
    ) -> None:
        name = child.description.name
        for number, patience_s in ESCALATION:
            if number != signal.SIGINT:
                self._say(f"{name} is still running: sending {number.name}")
            _signal_group(running.pid, number)
            await asyncio.wait({ending}, timeout=patience_s)
            if ending.done():
                return

    async def _relay(self, child: _Child, reading: int) -> None:
        """Forward the output in whole lines until the pipe is closed."""
        stream = asyncio.StreamReader()
        transport, _ = await asyncio.get_running_loop().connect_read_pipe(
            lambda: asyncio.StreamReaderProtocol(stream), os.fdopen(reading, "rb")
        )
        pending, traceback = b"", list[bytes]()
        try:
            while chunk := await stream.read(CHUNK):
                *lines, pending = (pending + chunk).split(b"\n")
                if len(pending) >= CHUNK:
                    lines, pending = [*lines, pending], b""
                if self._stopping.is_set():
                    lines, traceback = _hold_traceback([*traceback, *lines])
                self._write(child, lines)
        finally:
            transport.close()
            last = [*traceback, *([pending] if pending else [])]
            child.interrupted = bool(last) and last[-1].startswith(b"KeyboardInterrupt")
            self._write(child, [b"interrupted while it started"] if child.interrupted else last)

    # -- everything -----------------------------------------------------------------------------

    def _stop(self, why: str) -> None:
        if not self._stopping.is_set():
            self._stopping.set()
            self._say(why)
            return
        waiting = [c.description.name for c in self._children if c.running is not None]
        self._say(f"already stopping, waiting for {', '.join(waiting) or 'nothing'}")

    def _write(self, child: _Child, lines: Sequence[bytes]) -> None:
        said = [line.decode(errors="replace").strip() for line in lines if line.strip()]
        child.last_line = said[-1] if said else child.last_line
        prefix = f"[{child.description.name}]".ljust(self._width + 2)
        if self._coloured:
            prefix = f"\033[{child.colour}m{prefix}\033[0m"
        self._print(
            "".join(f"{prefix} {line.decode(errors='replace').rstrip()}\n" for line in lines)
        )

    def _say(self, text: str) -> None:
        self._print(f"[up] {text}\n")

    def _print(self, text: str) -> None:
        try:
            self._output.write(text)
            self._output.flush()
        except (BrokenPipeError, ValueError):
            # The reader of the output has closed it, as in `up | head`.
            self._stopping.set()
            self._output = open(os.devnull, "w")  # noqa: SIM115 (to the end of the process)
            os.dup2(self._output.fileno(), sys.stdout.fileno())


def _hold_traceback(lines: list[bytes]) -> tuple[list[bytes], list[bytes]]:
    """Split lines before a traceback from the traceback received so far."""
    for index, line in enumerate(lines):
        if line.startswith(b"Traceback "):
            return lines[:index], lines[index:]
    return lines, []


def _signal_group(group: int, number: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, number)


def _end_of(code: int) -> str:
    return "has finished" if code == 0 else f"has died ({_describe(code)})"


def _describe(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
