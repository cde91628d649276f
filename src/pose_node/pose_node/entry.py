"""Start of every executable: Ctrl-C ends it quietly even while it still imports.

An entry point of a ``setup.py`` names the module behind ``start``; the module's ``main`` is run::

    "fuse = pose_node.entry:start.pose_fusion.tools.fuse"

Nothing is imported here but what Python has loaded anyway; numpy and ROS take a second. Before
that, while Python itself starts, ``./pose`` keeps SIGINT blocked: it waits for us to let it in.
"""

import atexit
import os
import signal
import sys
from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from types import FrameType
    from typing import NoReturn

INTERRUPTED = 130  # 128 + SIGINT, as shells have it
STOPPED = 0  # of a node that ends on a signal, also while it starts
AGAIN_S = 0.001  # before an interrupt that came to nothing comes again
PIP_NAMES = {"cv2": "opencv-python-headless", "serial": "pyserial", "yaml": "PyYAML"}


class Interrupt:
    """A signal's handler: raises KeyboardInterrupt, unless that is switched off.

    An extension module that is interrupted while it is imported raises ImportError instead: then
    :attr:`asked` tells why.

    Args:
        once: For a node: only the first signal raises, since a second one must not interrupt the
            shutdown; and the process exits at once from a compilation, which takes a minute, as
            the compiler drops exceptions.
    """

    def __init__(self, *, once: bool) -> None:
        self.asked = False
        self.breaks_off = True
        self._once = once

    def listen(self, *numbers: int) -> None:
        """Handle these signals from now on."""
        for number in numbers:
            signal.signal(number, self)
        sys.unraisablehook = self._break_off_again

    def __call__(self, _number: int, frame: "FrameType | None") -> None:
        """Handle the signal."""
        is_first, self.asked = not self.asked, True
        if self._once and _compiles(frame):
            leave(STOPPED)
        if self.breaks_off and (is_first or not self._once):
            raise KeyboardInterrupt

    def _break_off_again(self, dropped: "sys.UnraisableHookArgs") -> None:
        """Raise again soon what Python has dropped: it came in a destructor, or while importing."""
        if dropped.exc_type is not KeyboardInterrupt:
            sys.__unraisablehook__(dropped)
            return
        signal.signal(signal.SIGALRM, self._on_alarm)
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S)

    def _on_alarm(self, _number: int, _frame: "FrameType | None") -> None:
        if self.breaks_off:
            raise KeyboardInterrupt


def _compiles(frame: "FrameType | None") -> bool:
    """Whether the compiler of the kernels is at work."""
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith(("numba.", "llvmlite.")):
            return True
        frame = frame.f_back
    return False


class Start:
    """Calling it imports the module whose dotted name it was reached by, and runs its ``main``."""

    def __init__(self, module: str = "") -> None:
        self._module = module

    def __getattr__(self, name: str) -> "Start":
        if name.startswith("_"):  # what others ask of any object
            raise AttributeError(name)
        return Start(f"{self._module}.{name}".lstrip("."))

    def __call__(self) -> None:
        """Run the module's ``main``."""
        is_node = ".nodes." in self._module
        interrupt = Interrupt(once=is_node)
        interrupt.listen(signal.SIGINT, *((signal.SIGTERM,) if is_node else ()))
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            import_module(self._module).main()
        except KeyboardInterrupt:
            self._stop(is_node)
        except ImportError as error:
            if interrupt.asked:
                self._stop(is_node)
            package, missing = (str(name).partition(".")[0] for name in (self._module, error.name))
            is_ours = missing == package or missing in sys.modules  # a module of it is not there
            if is_ours or not isinstance(error, ModuleNotFoundError):
                raise
            pip_name = PIP_NAMES.get(missing, missing)
            sys.exit(
                f"error: found no Python package '{missing}', which {package} needs: install it,"
                f" for example with 'python3 -m pip install {pip_name}'"
            )

    @staticmethod
    def _stop(is_node: bool) -> "NoReturn":
        if is_node:
            leave(STOPPED)
        sys.exit(INTERRUPTED)


def leave(status: int) -> "NoReturn":
    """End the process at once, ignoring further signals.

    Python would take half a second to free modules such as numba's one by one, in which one more
    signal ends it with an error.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM):
        signal.signal(number, signal.SIG_IGN)
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except (OSError, ValueError):  # nobody reads them any more
        pass
    os._exit(status)


start = Start()
