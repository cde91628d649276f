"""How every executable starts: Ctrl-C ends it quietly even while it still imports.

An entry point of a ``setup.py`` names the module behind ``start``; the module's ``main`` is run::

    "fuse = pose_node.entry:start.pose_fusion.tools.fuse"

Nothing is imported here but what Python has loaded anyway; numpy and ROS take a second. Before
that, while Python itself starts, ``./pose`` keeps SIGINT blocked: it waits for us to let it in.
"""

import signal
import sys
from importlib import import_module

INTERRUPTED = 130  # 128 + SIGINT, as shells have it


class Interrupt:
    """What SIGINT does: breaks off what is being done, unless told not to, and is remembered.

    A compiled module that is broken off in its making tells of a failed import instead.
    """

    def __init__(self) -> None:
        self.asked = False
        self.breaks_off = True

    def __call__(self, *_: object) -> None:
        """Handle the signal."""
        self.asked = True
        if self.breaks_off:
            raise KeyboardInterrupt


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
        interrupt = Interrupt()
        signal.signal(signal.SIGINT, interrupt)
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            import_module(self._module).main()
        except KeyboardInterrupt:
            sys.exit(INTERRUPTED)
        except ImportError:
            if not interrupt.asked:
                raise
            sys.exit(INTERRUPTED)


start = Start()
