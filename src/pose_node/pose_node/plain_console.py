"""Consoles for tables and progress, on a terminal or in a file."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn

WIDTH = 200  # [columns] without a terminal: no table is cut


def plain_console() -> Console:
    """A console as wide as the terminal; output to a pipe or a file is not cut."""
    return Console(width=None if sys.stdout.isatty() else WIDTH, highlight=False)


def progress_bar(console: Console, *more: ProgressColumn) -> Progress:
    """A progress bar with description and percentage, removed at the end; none in a file."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f} %"))
    return Progress(
        *columns, *more, console=console, transient=True, disable=not console.is_terminal
    )


def add_share(progress: Progress, what: str) -> Callable[[float], None]:
    """Add a task to a progress; returns the function that shows its share done, 0 to 1."""
    task = progress.add_task(what, total=1.0)
    return lambda share: progress.update(task, completed=share)


@contextmanager
def waiting_bar(console: Console, what: str) -> Iterator[None]:
    """A bar with the elapsed time while something runs whose end is not known; none in a file."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    disabled = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=disabled) as progress:
        progress.add_task(what, total=None)
        yield
