"""Child processes: installed executables, started so that they end with their parent."""

import ctypes
import os
import signal
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

from pose_core.errors import InputError

STOP_S = 20.0  # [s] longer than the launcher needs to kill hanging processes
PR_SET_PDEATHSIG = 1

_libc = ctypes.CDLL(None, use_errno=True)


def end_with_parent() -> Callable[[], None]:
    """Prepare a child before it executes its program (``preexec_fn`` of :mod:`subprocess`).

    The kernel then terminates it as soon as this process has ended, however it ends; and it heeds
    Ctrl-C, which the background jobs of a shell script otherwise inherit as ignored.
    """
    parent = os.getpid()

    def in_child() -> None:
        _libc.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent:  # it ended in between
            os._exit(1)
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return in_child


def of_package(find: Callable[[str], str], package: str) -> str:
    """What a function of :mod:`ament_index_python` finds of an installed package.

    Raises:
        InputError: If the package is missing.
    """
    try:
        return find(package)
    except (PackageNotFoundError, ValueError) as error:
        raise InputError(f"found no package '{package}': build and source its workspace") from error


def executable(package: str, name: str) -> Path:
    """The executable that ``ros2 run PACKAGE NAME`` finds.

    Raises:
        InputError: If the package or the executable is missing.
    """
    folder = Path(of_package(get_package_prefix, package)) / "lib" / package
    path = folder / name
    if not (path.is_file() and os.access(path, os.X_OK)):
        present = sorted(entry.name for entry in folder.glob("*") if os.access(entry, os.X_OK))
        raise InputError(
            f"package '{package}' has no executable '{name}':"
            f" there are {', '.join(present) or 'none'}; if it is new, build the workspace"
        )
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


def _last_error(errors: str) -> str:
    lines = [line.strip() for line in errors.splitlines() if line.strip()]
    return lines[-1].removeprefix("error: ") if lines else ""
