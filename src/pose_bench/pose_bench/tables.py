"""Tables for the terminal and for Markdown."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from rich import box
from rich.table import Table
from rich.text import Text

from pose_evaluation.tables import UNKNOWN, number


@dataclass(kw_only=True)
class TextTable:
    """A title, a header, and rows of cells; the first column names the row."""

    title: str
    header: Sequence[str]
    rows: list[Sequence[str]] = field(default_factory=list)
    note: str = ""

    def markdown(self) -> str:
        """The table as Markdown."""
        lines = [
            f"### {self.title}",
            "",
            f"| {' | '.join(self.header)} |",
            "|---" + "|---:" * (len(self.header) - 1) + "|",
            *(f"| {' | '.join(row)} |" for row in self.rows),
        ]
        if self.note:
            lines += ["", self.note]
        return "\n".join(lines) + "\n"

    def rich(self) -> Table:
        """The table for the terminal."""
        table = Table(
            title=Text(self.title, style="bold"),
            title_justify="left",
            caption=Text(self.note) if self.note else None,
            caption_justify="left",
            box=box.SIMPLE_HEAD,
            show_edge=False,
        )
        for index, name in enumerate(self.header):
            table.add_column(Text(name), justify="right" if index else "left", no_wrap=not index)
        for row in self.rows:
            table.add_row(*map(Text, row))
        return table


def percent(share: float) -> str:
    """Format a share in percent."""
    return UNKNOWN if not math.isfinite(share) else f"{number(100.0 * share, 0)} %"
