"""Angles over the cycle: mean of all cycles, with a band of one standard deviation."""

from pose_core.api import ANGLES
from pose_evaluation.gait_cycles import PERCENT
from pose_evaluation.tables import readable
from pose_view.report.analysis import REFERENCE, Analysis
from pose_view.report.figures.canvas import (
    FigureSet,
    group_of,
    method_style,
    picture,
    plot,
)


def cycle_figures(analysis: Analysis, side: str) -> FigureSet:
    """One side's angles over its cycles, by all methods."""
    curves = analysis.curves[side]
    sensors = analysis.recording.sensors
    pictures = []
    for angle in (name for name in ANGLES if name.startswith(side)):
        with plot() as (figure, (axes,)):
            for name, by_angle in curves.items():
                if angle not in by_angle:
                    continue
                curve, style = by_angle[angle], method_style(name, sensors)
                axes.fill_between(
                    PERCENT,
                    curve.mean_deg - curve.sd_deg,
                    curve.mean_deg + curve.sd_deg,
                    color=style["color"],
                    alpha=0.22 if name in (REFERENCE, analysis.recording.focus) else 0.09,
                    linewidth=0,
                    gid=group_of(name) + "--1",
                )
                axes.plot(PERCENT, curve.mean_deg, gid=group_of(name), **style)
            axes.set(xlabel="cycle [%]", ylabel="angle [deg]", xlim=(0.0, 100.0))
            title = readable(angle)
            pictures.append(picture(figure, title, f"{title} over the cycle"))
    return FigureSet(caption=f"Mean ± SD over the cycles, {side} side", pictures=pictures)
