"""A section of the page."""

from collections.abc import Sequence
from dataclasses import dataclass

from pose_evaluation.table import Table
from pose_view.report.figures.figure import FigureSet

Block = Table | FigureSet | str
"""A table, figures, or a paragraph."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A heading and its content."""

    anchor: str
    title: str
    blocks: Sequence[Block]
    has_methods: bool = False  # whether its figures show methods that can be hidden
