"""Bland–Altman plots, uncertainty bands, and sources of the degrees of freedom."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from pose_core.api import (
    ANGLES,
    EstimateSeries,
    FloatArray,
    Source,
    without_sideways_flexion,
    wrapped,
)
from pose_evaluation.table import number
from pose_evaluation.tables import method_label, readable
from pose_evaluation.uncertainty import stddev_at
from pose_view.report.analysis import REFERENCE, Analysis, Compared
from pose_view.report.figures.canvas import (
    COLUMNS,
    FigureSet,
    broken,
    line,
    method_style,
    picture,
    plot,
    without_wraps,
)
from pose_view.report.report_data import seconds
from pose_view.report.tables.stability import SOURCES

MAX_DOTS = 400  # largest number of dots in a plot
STRIP_COLUMNS = 700  # instants drawn in the strip of sources


def bland_altman_figures(analysis: Analysis, compared: Compared) -> FigureSet:
    """Difference of the focus method and the reference over their mean, by angle."""
    focus = analysis.recording.focus
    scores = compared.evaluation.method(focus)
    series = analysis.angles[focus].shifted(-round(scores.shift_s * 1e9))
    known = compared.reference.angles
    known = known.between(int(series.stamps_ns[0]), int(series.stamps_ns[-1]))
    expected, found = without_sideways_flexion(known.angles), series.at(known.stamps_ns)
    pictures = []
    for angle in ANGLES:
        difference = wrapped(found[angle] - expected[angle])
        mean = expected[angle] + 0.5 * difference
        keep = np.flatnonzero(np.isfinite(difference))
        keep = keep[:: max(1, len(keep) // MAX_DOTS)]
        score = scores.angles[angle]
        low, high = score.limits_of_agreement_deg
        with plot() as (figure, (axes,)):
            _dots(axes, np.degrees(mean[keep]), np.degrees(difference[keep]))
            _level(axes, score.bias_deg, "-", "bias")
            _level(axes, low, "--", "−1.96 SD")
            _level(axes, high, "--", "+1.96 SD")
            axes.set(xlabel="mean of both [deg]", ylabel="difference [deg]")
            title = readable(angle)
            pictures.append(picture(figure, title, f"Bland–Altman plot of {title}"))
    return FigureSet(caption=f"Bland–Altman: {method_label(focus)} − reference", pictures=pictures)


def _level(axes: Axes, value: float, dashes: str, name: str) -> None:
    """A horizontal line with its name and value [deg]."""
    if not np.isfinite(value):
        return
    axes.axhline(value, color="#D55E00", linewidth=1.1, linestyle=dashes)
    axes.annotate(
        f"{name} {number(value, 1, sign=True)}°",
        (1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(-2, 2),
        textcoords="offset points",
        ha="right",
        fontsize=8,
        color="#a34700",
        bbox={"color": "white", "alpha": 0.75, "pad": 0.5, "linewidth": 0.0},
    )


def _dots(axes: Axes, x: FloatArray, y: FloatArray) -> None:
    """Draw dots as one path of lines without length: a tenth of the markers' size."""
    gap = np.full(len(x), np.nan)
    columns = [np.column_stack([values, values, gap]).ravel() for values in (x, y)]
    (drawn,) = axes.plot(
        *columns, color="#0072B2", alpha=0.45, linewidth=2.6, solid_capstyle="round"
    )
    drawn.get_path().should_simplify = False


def uncertainty_figures(analysis: Analysis, method: str) -> FigureSet:
    """A method's angles with bands of 1 and 2 σ, and the reference."""
    recording = analysis.recording
    estimates, series = recording.estimates[method], analysis.angles[method]
    times = seconds(series.stamps_ns, recording.begin_ns)
    style = method_style(method, recording.sensors)
    pictures = []
    for angle in ANGLES:
        if angle not in estimates.names:
            continue
        sigma = np.degrees(stddev_at(estimates, angle, series.stamps_ns))
        values = without_wraps(np.degrees(series.angles[angle]))
        with plot() as (figure, (axes,)):
            for factor, alpha in ((2.0, 0.18), (1.0, 0.28)):
                at, low, high = _band(times, values, factor * sigma)
                axes.fill_between(at, low, high, color=style["color"], alpha=alpha, linewidth=0)
            shown = [values]
            line(axes, "band", times, values, {"color": style["color"], "linewidth": 1.0})
            if REFERENCE in analysis.angles:
                known = analysis.angles[REFERENCE]
                at = seconds(known.stamps_ns, recording.begin_ns)
                expected = without_wraps(np.degrees(known.angles[angle]))
                line(axes, "truth", at, expected, {"color": "#000000", "linewidth": 1.0})
                shown = [values, expected]
            axes.set(xlabel="time [s]", ylabel="angle [deg]", xlim=(0.0, recording.duration_s))
            axes.set_ylim(*_window(np.concatenate(shown), sigma))
            title = readable(angle)
            pictures.append(picture(figure, title, f"uncertainty of {title}"))
    return FigureSet(caption=f"{method_label(method)} with its own uncertainty", pictures=pictures)


def _band(
    times: FloatArray, values: FloatArray, reach: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, lower and upper edges, reduced to the plot's columns, with all gaps."""
    at, low, high = broken(times, values - reach, values + reach)
    regular = np.arange(0, len(at), max(1, len(at) // COLUMNS))
    keep = np.union1d(regular, np.flatnonzero(np.isnan(at)))
    return at[keep], low[keep], high[keep]


def _window(values: FloatArray, sigma: FloatArray) -> tuple[float, float]:
    """Limits [deg] that ignore short peaks of the uncertainty."""
    if not np.isfinite(values).any() or not np.isfinite(sigma).any():
        return -1.0, 1.0
    margin = 2.5 * float(np.nanmedian(sigma)) + 5.0
    return float(np.nanmin(values)) - margin, float(np.nanmax(values)) + margin


def source_figure(analysis: Analysis, method: str) -> FigureSet:
    """Source of each degree of freedom over time."""
    estimates = analysis.recording.estimates[method]
    names = [readable(name) for name in estimates.names]
    begin, end, states = _strip(estimates, analysis.recording.begin_ns)
    colours = ListedColormap([SOURCES[source][1] for source in Source])
    with plot(width=720.0, height=60.0 + 14.0 * len(names)) as (figure, (axes,)):
        axes.imshow(
            states.T,
            cmap=colours,
            vmin=-0.5,
            vmax=len(Source) - 0.5,
            aspect="auto",
            interpolation="nearest",
            extent=(begin, end, len(names) - 0.5, -0.5),
        )
        axes.set_yticks(range(len(names)), names, fontsize=9)
        axes.grid(False)
        axes.tick_params(length=0)
        for edge in np.arange(0.5, len(names) - 0.5):
            axes.axhline(edge, color="white", linewidth=1.0)
        axes.set(xlabel="time [s]", xlim=(0.0, analysis.recording.duration_s))
        drawing = picture(figure, "", f"sources of {method_label(method)} over time")
    caption = f"Source of each degree of freedom: {method_label(method)}"
    return FigureSet(caption=caption, pictures=[drawing], is_wide=True)


def _strip(estimates: EstimateSeries, begin_ns: int) -> tuple[float, float, np.ndarray]:
    """States at equal time steps; NaN in gaps."""
    times = seconds(estimates.stamps_ns, begin_ns)
    grid = np.linspace(times[0], times[-1], STRIP_COLUMNS)
    nearest = np.clip(np.searchsorted(times, grid), 0, len(times) - 1)
    states = estimates.source[nearest].astype(float)
    states[np.abs(times[nearest] - grid) > 0.2] = np.nan
    return float(times[0]), float(times[-1]), states
