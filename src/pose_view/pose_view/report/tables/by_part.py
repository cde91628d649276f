"""Tables with a row for each angle, bone or joint and a column for each method."""

from collections.abc import Mapping, Sequence
from typing import Any

from pose_evaluation.table import Row, Table, number_row
from pose_evaluation.tables import method_label, readable


def part_table(
    caption: str,
    head: str,
    values: Mapping[str, Mapping[str, float]],
    summary: Sequence[Row] = (),
    note: str = "",
    **style: Any,
) -> Table:
    """A table of values by method and part; ``style`` is that of :func:`number_row`."""
    rows = [
        number_row(readable(part), [each[part] for each in values.values()], **style)
        for part in next(iter(values.values()), {})
    ]
    columns = [method_label(name) for name in values]
    return Table(caption=caption, head=head, columns=columns, rows=(*rows, *summary), note=note)
