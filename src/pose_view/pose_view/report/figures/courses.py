"""Figures over time and over cycles, in the layout of the papers' figures.

Angles as in li2020's figures 4 and 5, a joint's x, y, z as in its figures 3 and 6, pitch, yaw and
roll of the limbs as in zhang2015's figures 6 to 9; bone lengths; and angles over the cycle.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pose_core.api import ANGLES, FloatArray, IntArray, SkeletonSeries, wrapped
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_evaluation.gait_cycles import PERCENT
from pose_evaluation.limb_attitude import (
    LIMBS,
    limb_attitude,
    limb_roll,
    model_of,
    segment_rotations,
)
from pose_evaluation.methods import FUSED
from pose_evaluation.stability import BONES, BONES_SHOWN, bone_lengths
from pose_evaluation.tables import method_label, readable
from pose_view.report.analysis import REFERENCE, Analysis
from pose_view.report.figures.canvas import (
    COLUMNS,
    HEIGHT,
    MAX_GAP_S,
    FigureSet,
    Picture,
    group_of,
    line,
    method_style,
    picture,
    plot,
    without_wraps,
)
from pose_view.report.report_data import seconds

TIME = "time [s]"
PAPER = "zhang2015"
ROLE_COLOURS = {
    "Kinect": "#56B4E9",
    "IMUs": "#117733",
    PAPER: "#AA4499",
    "fused": "#D55E00",
    REFERENCE: "#000000",
}
OCCLUDED = "#dddddd"


def angle_figures(analysis: Analysis) -> FigureSet:
    """Each angle over time, by all methods, with the reference."""
    pictures = []
    for angle in ANGLES:
        curves = {
            name: (series.stamps_ns, without_wraps(np.degrees(series.angles[angle])))
            for name, series in analysis.angles.items()
        }
        title = readable(angle)
        pictures.append(_over_time(analysis, curves, title, f"{title} over time", "angle [deg]"))
    return FigureSet(caption="", pictures=pictures)


def joint_figures(analysis: Analysis, joint: str) -> FigureSet:
    """One joint's x, y and z over time, as li2020's figure 3."""
    shown, index = _in_map(analysis), JOINT_INDEX[joint]
    pictures = []
    for axis, meaning in enumerate(("x, forward", "y, to the left", "z, up")):
        curves = {
            name: (series.stamps_ns, series.positions[:, index, axis])
            for name, series in shown.items()
        }
        title = f"{readable(joint)}: {meaning}"
        pictures.append(_over_time(analysis, curves, title, f"{title}, over time", "position [m]"))
    return FigureSet(caption="", pictures=pictures)


def _over_time(
    analysis: Analysis,
    curves: Mapping[str, tuple[IntArray, FloatArray]],
    title: str,
    label: str,
    unit: str,
) -> Picture:
    """Draw stamps [ns] and values of several methods, one line each."""
    recording = analysis.recording
    with plot() as (figure, (axes,)):
        for name, (stamps_ns, values) in curves.items():
            style = method_style(name, recording.sensors)
            line(axes, name, seconds(stamps_ns, recording.begin_ns), values, style)
        axes.set(xlabel=TIME, ylabel=unit, xlim=(0.0, recording.duration_s))
        return picture(figure, title, label)


def attitude_sources(analysis: Analysis) -> dict[str, str]:
    """The methods for the roles one Kinect, IMUs alone, zhang2015 of the two, fused, by role."""
    names = _limbs_in_map(analysis)
    roles = {
        "Kinect": next(iter(analysis.recording.T_map_sensor), ""),  # the one that zhang2015 fuses
        "IMUs": "imu",
        PAPER: PAPER,
        "fused": FUSED if FUSED in names else "default+imus",
    }
    return {role: name for role, name in roles.items() if name in names}


def attitude_figures(analysis: Analysis) -> FigureSet:
    """Pitch, yaw and roll of each limb by Kinect, IMUs and both, as zhang2015's figures 6 to 9.

    Times in which the Kinect does not track both ends of the limb are grey. Roll cannot be computed
    from joint positions, so raw Kinects and position references have none; neither have estimates
    with the user's own body model, whose links are not known here.
    """
    recording = analysis.recording
    sources = attitude_sources(analysis)
    in_map, named = _limbs_in_map(analysis), {REFERENCE: REFERENCE, **sources}
    shown = {role: in_map[name] for role, name in named.items() if name in in_map}
    known = {name: run.estimates for name, run in recording.limb_runs.items()}
    known |= recording.estimates
    rolls = {
        role: known[name]
        for role, name in sources.items()
        if name in known and model_of(known[name].names)
    }
    pictures = []
    for limb in LIMBS:
        with plot(rows=3, height=2.1 * HEIGHT) as (figure, (above, middle, below)):
            if "Kinect" in shown:
                hidden = occlusions(shown["Kinect"], limb, recording.begin_ns, recording.duration_s)
                for axes in (above, middle, below):
                    across = axes.get_xaxis_transform()
                    group = group_of("role occluded")
                    axes.broken_barh(hidden, (0, 1), transform=across, color=OCCLUDED, gid=group)
            attitudes = {role: limb_attitude(each.positions, limb) for role, each in shown.items()}
            centre = _middle([yaw for _, yaw in attitudes.values()])
            for role, series in shown.items():
                times = seconds(series.stamps_ns, recording.begin_ns)
                pitch, yaw = attitudes[role]
                yaw = without_wraps(np.degrees(centre + wrapped(yaw - centre)))
                line(above, f"role {role}", times, np.degrees(pitch), _role_style(role))
                line(middle, f"role {role}", times, yaw, _role_style(role))
            for role, estimates in rolls.items():
                times = seconds(estimates.stamps_ns, recording.begin_ns)
                R_map_segment = segment_rotations(estimates.names, estimates.position, limb)
                roll = without_wraps(np.degrees(limb_roll(R_map_segment)))
                line(below, f"role {role}", times, roll, _role_style(role))
            above.set(ylabel="pitch [deg]", xlim=(0.0, recording.duration_s))
            middle.set(ylabel="yaw [deg]")
            below.set(xlabel=TIME, ylabel="roll [deg]")
            figure.align_ylabels()
            title = readable(limb)
            pictures.append(picture(figure, title, f"pitch, yaw and roll of {title}"))
    return FigureSet(caption="", pictures=pictures)


def occlusions(
    series: SkeletonSeries, limb: str, begin_ns: int, duration_s: float
) -> list[tuple[float, float]]:
    """Times in which an end of a limb is not tracked, also because there are no frames.

    Args:
        series: A camera's skeletons.
        limb: One of :data:`LIMBS`.
        begin_ns: Zero of the times [ns].
        duration_s: Their end [s].

    Returns:
        Beginning and length [s] of each, in steps of a column of the plot.
    """
    times = np.concatenate([[0.0], seconds(series.stamps_ns, begin_ns), [duration_s]])
    ends = [JOINT_INDEX[joint] for joint in BONES[limb]]
    is_lost = (series.tracking_state[:, ends] < TrackingState.TRACKED).any(axis=1)
    steps = np.diff(times)
    is_hidden = np.append(True, is_lost) | (steps > MAX_GAP_S)
    edges = np.linspace(0.0, duration_s, COLUMNS + 1)
    hidden_s = np.interp(edges, times, np.append(0.0, np.cumsum(steps * is_hidden)))
    is_grey = np.diff(hidden_s) > 0.5 * duration_s / COLUMNS
    bounds = edges[np.flatnonzero(np.diff([False, *is_grey, False]))].reshape(-1, 2)
    return [(begin_s, end_s - begin_s) for begin_s, end_s in bounds.tolist()]


def _role_style(role: str) -> dict[str, Any]:
    return {"color": ROLE_COLOURS[role], "linewidth": 1.2 if role == "fused" else 0.9}


def bone_figures(analysis: Analysis) -> FigureSet:
    """Lengths of the limbs' bones over time."""
    methods = analysis.recording.methods
    lengths = {name: bone_lengths(each.positions) for name, each in methods.items()}
    pictures = []
    for bone in BONES_SHOWN:
        curves = {
            name: (each.stamps_ns, 100.0 * lengths[name][bone]) for name, each in methods.items()
        }
        title = readable(bone)
        label = f"length of {title} over time"
        pictures.append(_over_time(analysis, curves, title, label, "length [cm]"))
    return FigureSet(caption="Bone lengths over time", pictures=pictures)


def cycle_figures(analysis: Analysis, side: str) -> FigureSet:
    """One side's angles over its cycles, by all methods: mean ± one standard deviation."""
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


def legend(analysis: Analysis) -> dict[str, str]:
    """Labels of the methods by name: the reference, then in the order of the tables."""
    names = sorted(analysis.angles, key=lambda name: name != REFERENCE)
    return {name: method_label(name) for name in names}


def _limbs_in_map(analysis: Analysis) -> Mapping[str, SkeletonSeries]:
    """The methods' joints, with those for the limbs only and the cameras."""
    recording = analysis.recording
    views = {
        name: recording.views[name].transformed(T)
        for name, T in recording.T_map_sensor.items()
        if name in recording.views
    }
    runs = {name: run.series for name, run in recording.limb_runs.items() if len(run.series)}
    return {**_in_map(analysis), **runs, **views}


def _in_map(analysis: Analysis) -> Mapping[str, SkeletonSeries]:
    recording = analysis.recording
    found = {name: recording.in_map(name) for name in recording.methods}
    shown = {name: series for name, series in found.items() if series is not None}
    if analysis.compared is not None and analysis.compared.joints is not None:
        shown[REFERENCE] = analysis.compared.joints
    return shown


def _middle(yaws: Sequence[FloatArray]) -> float:
    """Mean direction [rad] about which all sources' yaws are unwrapped, ±π."""
    known = np.concatenate([yaw[np.isfinite(yaw)] for yaw in yaws]) if yaws else np.zeros(0)
    return float(np.angle(np.exp(1j * known).mean())) if len(known) else 0.0
