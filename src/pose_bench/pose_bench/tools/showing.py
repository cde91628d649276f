"""How every benchmark shows its tables and writes them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pose_bench.tables import TextTable
from pose_core.errors import writing
from pose_node.plain_console import plain_console


def show(tables: Sequence[TextTable]) -> None:
    """Print tables, an empty line after each."""
    console = plain_console()
    for table in tables:
        console.print(table.rich())
        console.print()


def publish(tables: Sequence[TextTable], title: str, folder: Path | None, name: str) -> None:
    """Print tables, and write them as a Markdown file ``name`` where a folder is given."""
    show(tables)
    if folder is not None:
        with output_folder(folder):
            (folder / name).write_text(document(title, tables))


def document(title: str, tables: Sequence[TextTable]) -> str:
    """Tables as one Markdown document."""
    return "\n".join([f"# {title}", "", *(table.markdown() for table in tables)])


@contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """A folder to write into, made if need be.

    Raises:
        InputError: If it, or anything in it, cannot be written.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
