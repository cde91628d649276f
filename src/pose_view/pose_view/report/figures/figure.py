"""Figures with captions."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Picture:
    """One plot."""

    title: str
    svg: str  # an <svg> element


@dataclass(frozen=True, kw_only=True)
class FigureSet:
    """Plots of one figure, side by side where there is room."""

    caption: str
    pictures: Sequence[Picture]
    is_wide: bool = False  # whether each plot has the page's full width
