"""Printing and writing the tables of benchmarks."""

from collections.abc import Sequence
from pathlib import Path

from pose_core.errors import writing
from pose_evaluation.table import Table
from pose_node.plain_console import plain_console


def show(tables: Sequence[Table]) -> None:
    """Print tables, each followed by an empty line."""
    console = plain_console()
    for table in tables:
        console.print(table.terminal())
        console.print()


def publish(
    tables: Sequence[Table], title: str, folder: Path | None, name: str, **others: str
) -> None:
    """Print tables, and write them as a Markdown file ``name`` where a folder is given.

    Args:
        tables: The tables.
        title: The document's heading.
        folder: Folder of the files, made if needed; None: nothing is written.
        name: The document's file.
        **others: Contents of further files by their names.

    Raises:
        InputError: If the folder, or a file in it, cannot be written.
    """
    show(tables)
    if folder is not None:
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            for file, text in {name: document(title, tables), **others}.items():
                (folder / file).write_text(text)


def document(title: str, tables: Sequence[Table]) -> str:
    """Tables as one Markdown document."""
    return "\n".join([f"# {title}", "", *(table.markdown() for table in tables)])
