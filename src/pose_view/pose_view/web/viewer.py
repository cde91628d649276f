"""The page: the scene, the panels, and their updates."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
import viser
from viser import GuiCheckboxHandle

from pose_node.node_status import Level
from pose_view.body.joint_marks import CERTAIN, COLORS, LEGEND, PALE, UNCERTAIN
from pose_view.parameters import ViewParameters
from pose_view.plain_words import StatusLine, as_html
from pose_view.recorded import Recorded
from pose_view.robot import JointTrack
from pose_view.snapshot import Snapshot
from pose_view.web.graph_panel import GraphCommands, GraphPanel
from pose_view.web.page_style import PHONE_STYLE
from pose_view.web.places import BodyPanel, place_of
from pose_view.web.playback_panel import PlaybackPanel
from pose_view.web.plots import PlotPanel, TrackOf
from pose_view.web.server import LocalServer
from pose_view.web.stage import Stage

PLOT_PERIOD_S = 0.15  # [s]
CONTROL_WIDTH = 270  # [px]


def legend_html() -> str:
    """A line for each colour of a joint, and a scale of certainty."""
    rows = "".join(
        f'<div style="display:flex;align-items:center;margin:0.2em 0">{_dot(color)}'
        f"<span>{meaning}</span></div>"
        for color, meaning in LEGEND.values()
    )
    steps = "".join(
        _dot(tuple(np.rint((1 - p) * np.array(COLORS["tracked"]) + p * PALE)), 0.75 + 0.35 * p)
        for p in (0.0, 0.25, 0.5, 0.75)
    )
    scale = (
        f'<div style="display:flex;align-items:center;margin-top:0.5em">{steps}'
        f"<span>certain to ±{np.degrees(CERTAIN):.0f}° … ±{np.degrees(UNCERTAIN):.0f}° or worse"
        "</span></div>"
    )
    return (
        '<div style="padding:0.25em 0.75em 0.5em;font-size:0.85em;line-height:1.35">'
        f"<b>Joints</b>{rows}{scale}</div>"
    )


def _absent_texts(places: list[BodyPanel], recorded: Recorded | None) -> dict[str, str]:
    """What the title of each body says as long as it has no data, by id."""
    if recorded is None:
        return {place.body: "nothing yet" for place in places}
    missing = "not recorded" if recorded.has_imus else "no IMUs recorded"
    return {
        place.body: "no pose yet" if place.body in recorded.bodies else missing for place in places
    }


def _warning(remark: str) -> StatusLine:
    title, _, text = remark.partition(": ")
    return StatusLine(level=Level.WARN, title=title, text=text)


def _dot(color: tuple, size: float = 0.85) -> str:
    r, g, b = (int(c) for c in color)
    return (
        f'<span style="flex:none;width:{size}em;height:{size}em;border-radius:50%;'
        f'background:rgb({r},{g},{b});margin-right:0.5em"></span>'
    )


class Viewer:
    """Content of the page; data are passed to :meth:`show`.

    Args:
        parameters: Address, bodies, rates.
        commands: Commands of a live graph's buttons; None without one.
        recorded: The recording; None without one.
    """

    def __init__(
        self,
        parameters: ViewParameters,
        *,
        commands: GraphCommands | None = None,
        recorded: Recorded | None = None,
    ) -> None:
        self.server = LocalServer(parameters.host, parameters.port)
        self.places = [place_of(body) for body in parameters.bodies]
        self.stage = Stage(self.server, self.places, _absent_texts(self.places, recorded))
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(CONTROL_WIDTH)
        self.playback = self.graph = None
        if recorded is not None:
            self.playback = PlaybackPanel(self.server, recorded.path, recorded.duration_s)
            if recorded.remarks:
                with gui.add_folder("Remarks"):
                    gui.add_html(as_html(map(_warning, recorded.remarks)))
        if commands is not None:
            self.graph = GraphPanel(self.server, commands)
        gui.add_html(legend_html() + PHONE_STYLE)
        self._add_choices()
        label = "time before now [s]" if recorded is None else "time [s]"
        self.plots = PlotPanel(self.server, self.places, parameters.plot_span, label)
        self._plotted_s = 0.0
        self._plot_span_s = parameters.plot_span
        self._switches: dict[str, GuiCheckboxHandle] = {}  # of people besides the requested bodies

    def show(
        self,
        snapshot: Snapshot,
        track_of: TrackOf,
        now_s: float,
        zero_s: float,
        robot: tuple[JointTrack, JointTrack] | None = None,
    ) -> None:
        """Update the page.

        Args:
            snapshot: Data to draw.
            track_of: Returns the history of each body, for the plots.
            now_s: Current time of the tracks [s].
            zero_s: Zero of the plots [s].
            robot: Histories of a robot's target angles and measured angles.
        """
        for name in sorted(snapshot.bodies.keys() - self.stage.avatars.keys()):
            self._add_person(name)
        self.stage.show(snapshot)
        if time.monotonic() - self._plotted_s < PLOT_PERIOD_S:
            return
        self._plotted_s = time.monotonic()
        for name in sorted(self._switches.keys() - snapshot.bodies.keys()):
            if not len(track_of(name, now_s - self._plot_span_s, now_s).times_s):
                self._remove_person(name)
        for body in snapshot.bodies.values():
            if body.dof is not None:
                self.plots.offer_dof(body.dof.names)
                break
        with self.server.atomic():
            self.plots.update(track_of, now_s, zero_s, robot)

    def _add_choices(self) -> None:
        """Add the check boxes of what is drawn."""
        gui = self.server.gui
        self._choices = gui.add_folder("Show")
        with self._choices:
            for place in self.places:
                self._add_body_switch(place)
            self._switch("Sensors", True, partial(setattr, self.stage, "shows_sensors"))
            show_ghosts = partial(setattr, self.stage, "shows_ghosts")
            self._switch("Raw skeletons of the cameras", False, show_ghosts)
            reset = gui.add_button("Reset view", icon=viser.Icon.HOME)
            reset.on_click(lambda _: setattr(self.stage, "has_view", False))

    def _add_person(self, body: str) -> None:
        """Add a person besides the requested bodies, at the position in map."""
        place = place_of(body)
        self.stage.add(place, "")
        self.plots.add(place)
        with self._choices:
            self._switches[body] = self._add_body_switch(place)

    def _remove_person(self, body: str) -> None:
        """Remove a person who has left and is no longer in the plots."""
        self.stage.remove(body)
        self.plots.remove(body)
        self._switches.pop(body).remove()

    def _add_body_switch(self, place: BodyPanel) -> GuiCheckboxHandle:
        avatar = self.stage.avatars[place.body]
        return self._switch(place.title, True, partial(setattr, avatar, "is_wanted"))

    def _switch(self, title: str, on: bool, act: Callable[[bool], None]) -> GuiCheckboxHandle:
        box = self.server.gui.add_checkbox(title, on)
        box.on_update(lambda _: act(box.value))
        return box
