"""Where tables are printed and progress is shown, on a terminal or in a file."""

import sys

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn

WIDTH = 200  # [columns] where no terminal tells: a table is cut nowhere


def plain_console() -> Console:
    """A console that fits the terminal, and cuts nothing in a pipe or a file."""
    return Console(width=None if sys.stdout.isatty() else WIDTH, highlight=False)


def progress_bar(console: Console, *more: ProgressColumn) -> Progress:
    """A bar with its description and share, which is gone at the end and never in a file."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f} %"))
    return Progress(
        *columns, *more, console=console, transient=True, disable=not console.is_terminal
    )
