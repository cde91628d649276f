"""Child processes that end with their parent."""

import ctypes
import os
import signal
from collections.abc import Callable

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
