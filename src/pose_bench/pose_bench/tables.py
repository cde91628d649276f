"""Tables that compare methods."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pose_core.finite_numbers import mean_known
from pose_evaluation.table import UNKNOWN, Table, number, text_row


def method_table(
    title: str,
    head: tuple[str, str],
    groups: Sequence[tuple[str, str, Sequence[Any]]],
    last: tuple[str, str],
    figures: Mapping[str, tuple[str, int]],
    note: str,
) -> Table:
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
    names = [*((name, second) for name, second, _ in groups), last]
    rows = [
        text_row(*name, *(number(mean, c[2]) for mean, c in zip(row, columns, strict=True)))
        for name, row in zip(names, means, strict=True)
    ]
    shown = [head[1], *(f"{method} {unit}" for unit in figures for method in methods)]
    return Table(caption=title, head=head[0], columns=shown, rows=rows, note=note)


def percent(share: float) -> str:
    """Format a share in percent."""
    return UNKNOWN if not math.isfinite(share) else f"{number(100.0 * share, 0)} %"
