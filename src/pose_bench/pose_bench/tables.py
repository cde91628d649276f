"""Tables that are made row by row."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pose_core.finite_numbers import mean_known
from pose_evaluation.table import UNKNOWN, Table, number, text_row


@dataclass(kw_only=True)
class TextTable:
    """A title, a header, and rows of cells; the first column names the row."""

    title: str
    header: Sequence[str]
    rows: list[Sequence[str]] = field(default_factory=list)
    note: str = ""

    @property
    def table(self) -> Table:
        """The table, to be rendered."""
        return Table(
            caption=self.title,
            head=self.header[0],
            columns=self.header[1:],
            rows=[text_row(*row) for row in self.rows],
            note=self.note,
        )


def method_table(
    title: str,
    head: tuple[str, str],
    groups: Sequence[tuple[str, str, Sequence[Any]]],
    last: tuple[str, str],
    figures: Mapping[str, tuple[str, int]],
    note: str,
) -> TextTable:
    """A table with a row per group, and the groups' mean; a column per figure and method.

    Args:
        title: The title.
        head: Headers of the first two columns.
        groups: First two cells and results, each of one method, of every row.
        last: First two cells of the row of means.
        figures: Field of the results and number of digits, by its unit.
        note: Text below the table.
    """
    methods = dict.fromkeys(each.method for _, _, own in groups for each in own)
    columns = [(method, *figure) for figure in figures.values() for method in methods]
    means = [
        [mean_known([getattr(e, field) for e in own if e.method == m]) for m, field, _ in columns]
        for _, _, own in groups
    ]
    means.append([mean_known(column) for column in zip(*means, strict=True)])
    texts = [
        [number(mean, digits) for mean, (_, _, digits) in zip(row, columns, strict=True)]
        for row in means
    ]
    names = [*((name, second) for name, second, _ in groups), last]
    return TextTable(
        title=title,
        header=(*head, *(f"{method} {unit}" for unit in figures for method in methods)),
        rows=[(*name, *cells) for name, cells in zip(names, texts, strict=True)],
        note=note,
    )


def percent(share: float) -> str:
    """Format a share in percent."""
    return UNKNOWN if not math.isfinite(share) else f"{number(100.0 * share, 0)} %"
