"""Printing and writing the tables of benchmarks."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pose_bench.tables import TextTable
from pose_core.errors import writing
from pose_node.plain_console import plain_console


def show(tables: Sequence[TextTable]) -> None:
    """Print tables, each followed by an empty line."""
    console = plain_console()
    for table in tables:
        console.print(table.table.terminal())
        console.print()


def publish(tables: Sequence[TextTable], title: str, folder: Path | None, name: str) -> None:
    """Print tables, and write them as a Markdown file ``name`` where a folder is given."""
    show(tables)
    if folder is not None:
        with output_folder(folder):
            (folder / name).write_text(document(title, tables))


def document(title: str, tables: Sequence[TextTable]) -> str:
    """Tables as one Markdown document."""
    return "\n".join([f"# {title}", "", *(table.table.markdown() for table in tables)])


@contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """Create a folder if needed, for writing.

    Raises:
        InputError: If the folder, or a file in it, cannot be written.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
