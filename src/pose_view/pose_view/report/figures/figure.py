"""A figure with its caption, as a value that the page shows."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Picture:
    """One drawing."""

    title: str
    svg: str  # an <svg> element


@dataclass(frozen=True, kw_only=True)
class FigureSet:
    """Drawings that belong together, shown side by side where there is room."""

    caption: str
    pictures: Sequence[Picture]
    is_wide: bool = False  # each one takes the page's whole width
