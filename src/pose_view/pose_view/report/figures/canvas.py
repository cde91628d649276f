"""Small plots as SVG text in a common style.

Plots have a phone's width; the page arranges as many side by side as fit. Each method's marks are
in a group with its own class, so that the page can hide them.
"""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from pose_core.api import FloatArray
from pose_view.report.analysis import REFERENCE

WIDTH, HEIGHT = 360.0, 215.0  # [pt] of a plot; one point is one CSS pixel of the drawing
DPI = 72  # points are the unit of the SVG
GROUP = "method-"  # prefix of the classes of methods' marks
COLUMNS = 500  # columns of a plot for which a line's extremes are drawn
MAX_GAP_S = 0.2  # [s] longest interval across which a line is drawn
STYLE: Any = {
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "pose",  # the same plot gives the same bytes
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 9.5,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#777777",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "path.simplify_threshold": 0.4,
}
GREY = "#555555"
# Okabe and Ito (2008), and Tol's muted colours: distinguishable with any colour vision.
METHODS = {
    REFERENCE: ("#000000", "what it is compared with"),
    "fused": ("#D55E00", "what the recording itself holds"),
    "mean": ("#8C8C8C", "of all cameras, without a filter"),
    "joint_kf": ("#E69F00", "a linear Kalman filter for each joint's position (Moon et al. 2016)"),
    "dof_kf": ("#999933", "a linear Kalman filter on joint angles (the ablation of Li et al.)"),
    "li2020": ("#0072B2", "the unscented filter on a kinematic tree of Li et al. (2020)"),
    "zhang2015": (GREY, "cameras and IMUs weighted by their variances (Zhang et al. 2015)"),
    "default": ("#AA1166", "this project's error-state filter on a kinematic tree"),
    "smoothed": (GREY, "the same, which looks ahead too"),
    "ukf": (GREY, "the default by its other name"),
    "imu": ("#117733", "the IMUs alone"),
}
"""Colour and description of each method; all others are cameras."""
SENSOR_COLOURS = ("#56B4E9", "#009E73", "#BBAA00", "#6699CC")


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


def method_style(name: str, sensors: Sequence[str]) -> dict[str, Any]:
    """Colour, width [pt] and dashes of a method's line."""
    if name in sensors:
        colour = SENSOR_COLOURS[list(sensors).index(name) % len(SENSOR_COLOURS)]
        return {"color": colour, "linewidth": 0.9}
    plain = name.removesuffix("+imus")
    dashes: Any = (0, (4, 1.2)) if plain != name else "-"
    width = 1.7 if name in (REFERENCE, "fused") else 1.2
    colour, _ = METHODS.get(plain, (GREY, ""))
    return {"color": colour, "linewidth": width, "linestyle": dashes}


def group_of(name: str) -> str:
    """The class of a method's marks."""
    return GROUP + re.sub(r"[^a-z0-9_]", "-", name.lower())


@contextmanager
def plot(
    rows: int = 1, width: float = WIDTH, height: float = HEIGHT
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Create a figure with plots in one column, in the report's style."""
    with mpl.rc_context(STYLE):
        size = (width / DPI, height / DPI)
        figure = Figure(figsize=size, dpi=DPI, layout="constrained")
        figure.get_layout_engine().set(w_pad=0.03, h_pad=0.03)  # type: ignore[union-attr, call-arg]
        figure.patch.set_visible(False)
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False)
        yield figure, list(axes[:, 0])


def picture(figure: Figure, title: str, label: str) -> Picture:
    """The figure for a page.

    Args:
        figure: A figure drawn inside :func:`plot`.
        title: Title above it.
        label: Description for screen readers.
    """
    out = io.StringIO()
    FigureCanvasSVG(figure).print_svg(out, metadata={"Date": None})
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'\s(xmlns(:\w+)?|version)="[^"]*"', "", text)
    text = re.sub(r'<svg width="[^"]*" height="[^"]*"|<svg height="[^"]*"', "<svg", text, count=1)
    text = re.sub(rf' id="({GROUP}[^"]*?)(--\d+)?"', r' class="\1"', text)
    # Ids of matplotlib's groups repeat in every figure; those of markers and clips are hashes.
    text = re.sub(r' id="[\w.]+_[0-9]+"', "", text)
    text = re.sub(r' transform="rotate\(-0 [^"]*"', "", text)
    text = re.sub(r' (?:d|x|y)="[^"]*"', lambda m: _shortened(m[0]), text)
    text = re.sub(r"\s*\n\s*", "\n", text)
    text = text.replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1)
    return Picture(title=title, svg=text)


def line(
    axes: Axes, name: str, times_s: FloatArray, values: FloatArray, style: dict[str, Any]
) -> None:
    """Draw a method's line, interrupted where values are unknown."""
    times_s, values = broken(times_s, values)
    times_s, values = thinned(times_s, values)
    if np.isfinite(values).any():
        axes.plot(times_s, values, gid=group_of(name), **style)


def broken(times_s: FloatArray, *columns: FloatArray) -> tuple[FloatArray, ...]:
    """Insert NaN into times [s] and values at every gap."""
    silent = np.flatnonzero(np.diff(times_s) > MAX_GAP_S) + 1
    return tuple(np.insert(values, silent, np.nan) for values in (times_s, *columns))


def thinned(times_s: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Reduce a line to the extremes and gaps of each column of the plot."""
    step = -(-len(values) // COLUMNS)
    if step <= 2:
        return times_s, values
    padded = np.full(step * -(-len(values) // step), np.nan)
    padded[: len(values)] = values
    buckets = padded.reshape(-1, step)
    known = np.isfinite(buckets)
    first = np.arange(len(buckets)) * step
    extremes = (
        first + np.where(known, buckets, np.inf).argmin(axis=1),
        first + np.where(known, buckets, -np.inf).argmax(axis=1),
        first + known.argmin(axis=1),  # the first gap, if there is one
    )
    chosen = np.unique(np.concatenate(extremes))
    chosen = chosen[chosen < len(values)]
    return times_s[chosen], values[chosen]


def without_wraps(degrees: FloatArray) -> FloatArray:
    """Replace values at wraps by NaN, so that no line is drawn across."""
    result = degrees.copy()
    with np.errstate(invalid="ignore"):
        result[1:][np.abs(np.diff(degrees)) > 0.75 * 360.0] = np.nan
    return result


def _shortened(attribute: str) -> str:
    """Round coordinates to tenths of a pixel and remove redundant blanks."""
    rounded = re.sub(r"-?\d+\.\d+", lambda m: f"{float(m[0]):.1f}".removesuffix(".0"), attribute)
    return " " + re.sub(r"\s*([MLCQz])\s*", r"\1", rounded.strip())
