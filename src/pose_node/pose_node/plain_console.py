"""Where tables are printed: as wide as the terminal, or whole where there is none."""

import sys

from rich.console import Console

WIDTH = 200  # [columns] where no terminal tells: a table is cut nowhere


def plain_console() -> Console:
    """A console that fits the terminal, and cuts nothing in a pipe or a file."""
    return Console(width=None if sys.stdout.isatty() else WIDTH, highlight=False)
