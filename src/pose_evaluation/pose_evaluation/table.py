"""A table of numbers with the best of each row marked, and its forms: terminal, Markdown."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from rich import box, table
from rich.text import Text

T = TypeVar("T")
UNKNOWN = "–"
BestOf = Callable[[Sequence[float]], float]
"""Selects the best of several known values: ``min`` of errors, ``max`` of correlations."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One formatted number."""

    text: str
    is_best: bool = False


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of a table."""

    name: str
    cells: Sequence[Cell]
    is_summary: bool = False  # separated from the lines above


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table with its caption."""

    caption: str  # with units
    head: str  # of the first column
    columns: Sequence[str]
    rows: Sequence[Row]
    note: str = ""

    @property
    def is_empty(self) -> bool:
        """Whether the table has no values."""
        return all(cell.text == UNKNOWN for row in self.rows for cell in row.cells)

    def terminal(self) -> table.Table:
        """The table for the terminal; the best values are bold."""
        made = table.Table(
            title=Text(self.caption, style="bold"),
            title_justify="left",
            caption=Text(self.note) if self.note else None,
            caption_justify="left",
            box=box.SIMPLE_HEAD,
            show_edge=False,
        )
        made.add_column(Text(self.head), no_wrap=True)
        for name in self.columns:
            made.add_column(Text(name), justify="right")
        for row in self.rows:
            if row.is_summary:
                made.add_section()
            cells = (Text(cell.text, style="bold" if cell.is_best else "") for cell in row.cells)
            made.add_row(Text(row.name), *cells)
        return made

    def markdown(self) -> str:
        """The table as Markdown."""
        lines = [
            f"### {self.caption}",
            "",
            f"| {' | '.join((self.head, *self.columns))} |",
            "|---" + "|---:" * len(self.columns) + "|",
            *(f"| {' | '.join((row.name, *(c.text for c in row.cells)))} |" for row in self.rows),
        ]
        if self.note:
            lines += ["", self.note]
        return "\n".join(lines) + "\n"


def table_of(
    caption: str,
    head: str,
    items: Iterable[tuple[str, T]],
    columns: Mapping[str, Callable[[T], str]],
    note: str = "",
) -> Table:
    """A table with a row for each item.

    Args:
        caption: The caption, with units.
        head: Header of the first column, the items' names.
        items: Name and item of each row.
        columns: Function from an item to its cell, by the column's header.
        note: Text below the table.
    """
    rows = [text_row(name, *(cell(item) for cell in columns.values())) for name, item in items]
    return Table(caption=caption, head=head, columns=list(columns), rows=rows, note=note)


def nearest_zero(values: Sequence[float]) -> float:
    """The value nearest to zero, for biases and lags."""
    return min(values, key=abs)


def number_row(
    name: str,
    values: Sequence[float],
    digits: int,
    best: BestOf | None = None,
    *,
    sign: bool = False,
    is_summary: bool = False,
) -> Row:
    """A line of numbers, with the best marked if ``best`` is given."""
    shown = [number(value, digits, sign=sign) for value in values]
    known = [value for value in values if math.isfinite(value)]
    mark = number(best(known), digits, sign=sign) if best is not None and known else None
    marked = len(known) > 1
    return Row(
        name=name,
        cells=[Cell(text=text, is_best=marked and text == mark) for text in shown],
        is_summary=is_summary,
    )


def text_row(name: str, *texts: str, is_summary: bool = False) -> Row:
    """A line of texts."""
    return Row(name=name, cells=[Cell(text=text) for text in texts], is_summary=is_summary)


def number(value: float, digits: int, *, sign: bool = False) -> str:
    """Format a number with a minus sign (U+2212); a dash if it is unknown."""
    if not math.isfinite(value):
        return UNKNOWN
    rounded = round(value, digits) + 0.0  # no −0.0
    return f"{rounded:{'+' if sign and rounded else ''}.{digits}f}".replace("-", "−")
