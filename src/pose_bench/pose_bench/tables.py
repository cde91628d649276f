"""Tables that are made row by row."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

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
            columns=tuple(self.header[1:]),
            rows=tuple(text_row(*row) for row in self.rows),
            note=self.note,
        )


def percent(share: float) -> str:
    """Format a share in percent."""
    return UNKNOWN if not math.isfinite(share) else f"{number(100.0 * share, 0)} %"
