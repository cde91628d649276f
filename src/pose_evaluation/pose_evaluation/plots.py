"""Plots of a recording: joint angles over time, errors by angle, bone lengths.

Figures are created without pyplot, without global state and without a display.
Colours are those of Okabe and Ito (2008), which are distinguishable with any colour vision.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pose_core.api import ANGLES, MAX_GAP_S, FloatArray, SkeletonSeries, joint_angles
from pose_core.errors import InputError, writing
from pose_core.joints import SIDES
from pose_evaluation.scores import Evaluation
from pose_evaluation.stability import BONES, bone_lengths

REFERENCE = "reference"
STYLE: dict[str, tuple[str, float, str]] = {  # colour, line width [pt], line style
    REFERENCE: ("#000000", 1.6, "-"),
    "fused": ("#D55E00", 1.3, "-"),
    "mean": ("#CC79A7", 0.9, "-"),
}
SENSOR_COLOURS = ("#56B4E9", "#009E73", "#F0E442", "#0072B2")
DPI = 110  # [1/inch]
BONES_SHOWN = tuple(
    f"{side}_{bone}" for bone in ("thigh", "shank", "upper_arm", "forearm") for side in SIDES
)


def angles_figure(title: str, series: Mapping[str, SkeletonSeries]) -> Figure:
    """The twelve angles over time, one small plot each.

    Args:
        title: Title, which names a synthetic subject as such.
        series: Joints by name; ``reference``, ``mean`` and ``fused`` have styles of their own,
            all others are sensors. Drawn in the order given.

    Raises:
        InputError: If there is nothing to draw.
    """
    found = {name: joint_angles(each.positions) for name, each in series.items()}
    half = len(ANGLES) // 2  # left side in the left column, as in the table
    panels = {
        angle.replace("_", " "): {name: np.degrees(each[angle]) for name, each in found.items()}
        for pair in zip(ANGLES[:half], ANGLES[half:], strict=True)
        for angle in pair
    }
    return _grid_figure(title, series, panels, "[deg]", height=13.0)


def bone_lengths_figure(title: str, series: Mapping[str, SkeletonSeries]) -> Figure:
    """Lengths of the limbs' bones over time, one small plot each.

    Args:
        title: Title.
        series: Joints by name, as for :func:`angles_figure`.

    Raises:
        InputError: If there is nothing to draw.
    """
    found = {name: bone_lengths(each.positions) for name, each in series.items()}
    panels = {
        f"{bone} ({' to '.join(BONES[bone])})".replace("_", " "): {
            name: 100.0 * each[bone] for name, each in found.items()
        }
        for bone in BONES_SHOWN
    }
    return _grid_figure(title, series, panels, "[cm]", height=9.0)


def errors_figure(evaluation: Evaluation) -> Figure:
    """RMSE by angle and method, and their mean, as bars."""
    figure = Figure(figsize=(11.0, 5.6), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    names = [method.name for method in evaluation.methods]
    width = 0.8 / len(names)
    groups = np.arange(len(ANGLES) + 1.0)
    groups[-1] += 0.5  # space before the mean
    for index, method in enumerate(evaluation.methods):
        values = [method.angles[angle].rmse_deg for angle in ANGLES] + [method.mean_rmse_deg]
        colour, _, _ = style_of(method.name, names)
        label = f"{method.name} (mean {method.mean_rmse_deg:.1f}°)"
        axes.bar(
            groups + (index - 0.5 * (len(names) - 1)) * width,
            values,
            0.92 * width,
            color=colour,
            label=label,
        )
    labels = [angle.replace("_", "\n") for angle in ANGLES] + ["mean"]
    axes.set_xticks(groups, labels, fontsize=8.5)
    axes.set_ylabel("RMSE [deg]")
    axes.margins(x=0.01)
    axes.grid(axis="y", color="0.85", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(ncols=len(names), frameon=False, fontsize=10, loc="upper left")
    axes.set_ylim(top=1.12 * axes.get_ylim()[1])
    subject = ", simulated sensors" if evaluation.synthetic else ""
    axes.set_title(
        f"Joint angle error against {evaluation.reference}{subject}", fontsize=12, loc="left"
    )
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG; the same figure gives the same bytes.

    Raises:
        InputError: If the file cannot be written.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        FigureCanvasAgg(figure).print_png(str(path), metadata={"Software": None})


def style_of(name: str, names: Sequence[str]) -> tuple[str, float, str]:
    """Colour, line width [pt] and line style of a method among all those drawn."""
    if name in STYLE:
        return STYLE[name]
    sensors = [other for other in names if other not in STYLE]
    return SENSOR_COLOURS[sensors.index(name) % len(SENSOR_COLOURS)], 0.9, "-"


def _grid_figure(
    title: str,
    series: Mapping[str, SkeletonSeries],
    panels: Mapping[str, Mapping[str, FloatArray]],
    unit: str,
    height: float,
) -> Figure:
    """Small plots over time in two columns, row by row: by title, each series' values."""
    begins = [int(each.stamps_ns[0]) for each in series.values() if len(each)]
    if not begins:
        raise InputError("nothing to plot: no method has a skeleton")
    figure = Figure(figsize=(12.0, height), dpi=DPI, layout="constrained")
    figure.suptitle(title, fontsize=13, x=0.01, ha="left")
    plots = figure.subplots(len(panels) // 2, 2, sharex=True)
    for axes, (panel, values) in zip(plots.flat, panels.items(), strict=True):
        for name, each in series.items():
            times = (each.stamps_ns - min(begins)) * 1e-9
            # Interrupted at missing samples and where an angle wraps.
            jumps = (np.diff(times) > MAX_GAP_S) | (np.abs(np.diff(values[name])) > 180.0)
            points = np.insert([times, values[name]], np.flatnonzero(jumps) + 1, np.nan, axis=1)
            colour, width, style = style_of(name, list(series))
            axes.plot(*points, style, color=colour, linewidth=width, label=name)
        axes.set_title(panel, fontsize=10, loc="left", pad=3)
        axes.set_ylabel(unit, fontsize=9)
        axes.grid(color="0.88", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=9)
        axes.margins(x=0.005)
    for axes in plots[-1]:
        axes.set_xlabel("time [s]", fontsize=10)
    handles, labels = plots[0, 0].get_legend_handles_labels()
    legend = figure.legend(
        handles, labels, loc="outside upper right", ncols=len(labels), frameon=False, fontsize=11
    )
    for line in legend.get_lines():
        line.set_linewidth(2.5)
    figure.align_ylabels()
    return figure
