"""Panel with plots of selected angles, one line per body."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pose_core.api import FloatArray
from pose_view.curves import BodyTrack, curve, occlusion, on_grid, titles
from pose_view.robot import JointTrack
from pose_view.web.places import BodyPanel
from pose_view.web.server import LocalServer

WIDTH, HEIGHT = 340, 128  # [px] of a plot, whose width is the panel's
LEFT, RIGHT, TOP, BOTTOM = 40, 8, 6, 30
MAX_TICKS = 5  # [-]
STEPS = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0)  # between ticks
DEFAULTS = (
    "Pitch: right forearm",
    "Yaw: right forearm",
    "Right knee flexion",
    "Right shoulder flexion",
)
GRID_RATE = 20.0  # [Hz] points of a curve
GAP_S = 0.25  # [s] longest interval that is interpolated
MARGIN = 5.0  # [°] above and below the curves
ROBOT = "Robot: "  # prefix of a robot's joint
OCCLUDED = "#dfe1e6"  # behind the curves
ASKED_LINE, ROBOT_LINE = "#c2541b", "#39424e"  # of the person's pose and the robot, for CSS
TrackOf = Callable[[str, float, float], BodyTrack]
"""Returns the track of a body (its id) between two times [s]."""


def svg_plot(
    x: FloatArray,
    rows: Sequence[FloatArray],
    colors: Sequence[str],
    *,
    x_label: str,
    y_label: str,
    y_range: tuple[float, float],
    is_grey: NDArray[np.bool_] | None = None,
) -> str:
    """A line plot as an SVG element; curves are interrupted where values are NaN.

    Lengths are in SVG units, which are scaled to the page's width.

    Args:
        x: Horizontal values, shape (n,), ascending, n at least 2.
        rows: Curves, shape (n,) each, NaN where interrupted.
        colors: Colours of the curves, for CSS.
        x_label: Label of the horizontal axis, with its unit.
        y_label: Label of the vertical axis, with its unit.
        y_range: Limits of the vertical axis.
        is_grey: Where the background is grey, shape (n,).
    """
    across: Callable[..., Any] = partial(np.interp, xp=(x[0], x[-1]), fp=(LEFT, WIDTH - RIGHT))
    down: Callable[..., Any] = partial(np.interp, xp=y_range, fp=(HEIGHT - BOTTOM, TOP))
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" style="display:block;width:100%" '
        'font-family="sans-serif" font-size="9.5">'
    ]
    if is_grey is not None:
        edges = np.flatnonzero(np.diff([False, *is_grey, False])).reshape(-1, 2)
        for begin, end in across(x[np.minimum(edges, len(x) - 1)]).tolist():
            where = f'x="{begin:.1f}" y="{TOP}" width="{end - begin:.1f}"'
            parts.append(f'<rect {where} height="{HEIGHT - BOTTOM - TOP}" fill="{OCCLUDED}"/>')
    for tick in ticks(*y_range):
        grid = "#b8bcc4" if tick == 0.0 else "#e6e8ec"
        parts.append(f'<path d="M{LEFT} {down(tick):.1f}H{WIDTH - RIGHT}" stroke="{grid}"/>')
        parts.append(_text(LEFT - 4, down(tick) + 3.3, f"{tick:g}", "end"))
    for tick in ticks(float(x[0]), float(x[-1])):
        parts.append(f'<path d="M{across(tick):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#e6e8ec"/>')
        parts.append(_text(across(tick), HEIGHT - BOTTOM + 11, f"{tick:g}"))
    parts.append(_text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 5, x_label))
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(
        f'<text x="10" y="{middle}" text-anchor="middle" fill="#4b4f58" '
        f'transform="rotate(-90 10 {middle})">{y_label}</text>'
    )
    for row, color in zip(rows, colors, strict=True):
        style = f'fill="none" stroke="{color}" stroke-width="1.6" stroke-linejoin="round"'
        parts.append(f'<path d="{_path(across(x), down(row))}" {style}/>')
    return "".join([*parts, "</svg>"])


def ticks(low: float, high: float) -> list[float]:
    """Round values in a range, at most :data:`MAX_TICKS` and one."""
    step = next((s for s in STEPS if (high - low) / s <= MAX_TICKS), STEPS[-1])
    first = int(np.ceil(low / step - 1e-9))
    last = int(np.floor(high / step + 1e-9))
    return [step * k for k in range(first, last + 1)]


def _path(x: FloatArray, y: FloatArray) -> str:
    """SVG path through the points, interrupted at NaN."""
    known = np.isfinite(y)
    letters = np.where(known & np.append(False, known[:-1]), "L", "M")[known].tolist()
    points = zip(letters, x[known].tolist(), y[known].tolist(), strict=True)
    return "".join(f"{letter}{px:.1f} {py:.1f}" for letter, px, py in points)


def _text(x: float, y: float, text: str, anchor: str = "middle") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="#4b4f58">{text}</text>'


class PlotPanel:
    """Plots at the right edge.

    Args:
        server: The server.
        places: The bodies.
        span_s: Time span of the plots [s].
        time_label: Label of the horizontal axis.
    """

    def __init__(
        self, server: LocalServer, places: Sequence[BodyPanel], span_s: float, time_label: str
    ) -> None:
        self._places = list(places)
        self._span_s = span_s
        self._time_label = time_label
        self._titles = titles()
        self._robot_joints: dict[str, str] = {}  # by title
        gui = server.gui
        panel = gui.add_panel()
        with panel.add_tab("Angles"):
            self.legend = gui.add_html("")
            self._plots: list[tuple[Any, Any]] = [
                (gui.add_dropdown("Angle", self._titles, initial_value=title), gui.add_html(""))
                for title in DEFAULTS
            ]
        panel.dock_right()
        panel.set_width(WIDTH)
        self._write_legend()

    def add(self, place: BodyPanel) -> None:
        """Add a body's curves."""
        self._places.append(place)
        self._write_legend()

    def remove(self, body: str) -> None:
        """Remove a body's curves."""
        self._places = [place for place in self._places if place.body != body]
        self._write_legend()

    def _write_legend(self) -> None:
        """Titles with the colours of their lines."""
        lines = [(place.title, place.line) for place in self._places]
        lines += [("Robot", ROBOT_LINE)] if self._robot_joints else []
        lines.append(("limb not tracked by the first camera", OCCLUDED))
        dots = "".join(
            f'<span style="white-space:nowrap;margin-right:1em"><span style="display:inline-block;'
            f"width:1.4em;height:0.28em;vertical-align:middle;margin-right:0.4em;"
            f'background:{color}"></span>{title}</span>'
            for title, color in lines
        )
        self.legend.content = f'<div style="padding:0.5em 0.75em 0;font-size:0.85em">{dots}</div>'

    def offer_dof(self, names: tuple[str, ...]) -> None:
        """Add the model's joint angles to the choices, once their names are known."""
        offered = (*titles(names), *self._robot_joints)
        if offered != self._titles:
            self._titles = offered
            for chosen, _ in self._plots:
                chosen.options = offered

    def _offer_robot(self, joints: Sequence[str]) -> None:
        """Add a robot's joints to the choices, and show the first ones."""
        self._robot_joints = {
            ROBOT + joint.removesuffix("_joint").replace("_", " "): joint for joint in joints
        }
        self._write_legend()
        self._titles = (*self._titles, *self._robot_joints)
        for (chosen, _), title in zip(self._plots, self._robot_joints, strict=False):
            chosen.options, chosen.value = self._titles, title

    def update(
        self,
        track_of: TrackOf,
        now_s: float,
        zero_s: float = 0.0,
        robot: tuple[JointTrack, JointTrack] | None = None,
    ) -> None:
        """Draw the plots up to a time.

        Args:
            track_of: Returns the history of each body.
            now_s: Right end of the plots [s].
            zero_s: Zero of the horizontal axis [s].
            robot: Histories of a robot's target angles and measured angles.
        """
        if robot is not None and not self._robot_joints:
            self._offer_robot(robot[1].joints)
        count = round(self._span_s * GRID_RATE) + 1
        grid = np.linspace(now_s - self._span_s, now_s, count)
        tracks = [track_of(place.body, grid[0] - GAP_S, now_s) for place in self._places]
        seen = next((track for track in tracks if track.is_occluded is not None), None)
        for chosen, plot in self._plots:
            joint = self._robot_joints.get(chosen.value)
            if joint is None:
                curves = ((track.times_s, curve(chosen.value, track)) for track in tracks)
                rows = [on_grid(times_s, values, grid, GAP_S) for times_s, values in curves]
                colors = [place.line for place in self._places]
            elif robot is None:
                continue
            else:
                rows = [_joint_row(joint, track, grid) for track in robot]
                colors = [ASKED_LINE, ROBOT_LINE]
            is_grey = occlusion(chosen.value, seen, grid) if seen else None
            labels = {"x_label": self._time_label, "y_label": "angle [°]"}
            plot.content = svg_plot(
                grid - zero_s, rows, colors, y_range=_range(rows), is_grey=is_grey, **labels
            )


def _joint_row(joint: str, track: JointTrack, grid: FloatArray) -> FloatArray:
    if joint not in track.joints:
        return np.full(len(grid), np.nan)
    values = np.degrees(track.position[:, track.joints.index(joint)])
    return on_grid(track.times_s, values, grid, GAP_S)


def _range(rows: Sequence[FloatArray]) -> tuple[float, float]:
    """Limits of the vertical axis [°]: multiples of ten, with a smallest range."""
    known = np.concatenate([row[np.isfinite(row)] for row in rows])
    if not len(known):
        return -10.0, 10.0
    low = 10.0 * np.floor((known.min() - MARGIN) / 10.0)
    high = 10.0 * np.ceil((known.max() + MARGIN) / 10.0)
    return float(low), float(max(high, low + 20.0))
