"""How every benchmark shows its tables and writes them."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from pose_bench.tables import TextTable
from pose_core.errors import InputError

WIDTH = 120  # [columns] of the tables where there is no terminal


def show(tables: Sequence[TextTable]) -> None:
    """Print tables, an empty line after each."""
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    for table in tables:
        console.print(table.rich())
        console.print()


def document(title: str, tables: Sequence[TextTable]) -> str:
    """Tables as one Markdown document."""
    return "\n".join([f"# {title}", "", *(table.markdown() for table in tables)])


@contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """A folder to write into, made if need be.

    Raises:
        InputError: If it, or anything in it, cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}") from error
