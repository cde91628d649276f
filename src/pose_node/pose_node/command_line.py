"""Start and end of every command-line tool."""

import sys
from collections.abc import Callable

from pose_core.errors import PoseError


def run_tool(main: Callable[[], int | None]) -> None:
    """Run a tool's main function and exit; a :class:`PoseError` becomes one line and status 1."""
    try:
        status = main() or 0
    except PoseError as error:
        print(f"error: {error}", file=sys.stderr)
        status = 1
    except KeyboardInterrupt:
        status = 130
    except BrokenPipeError:
        status = 141
    sys.exit(status)
