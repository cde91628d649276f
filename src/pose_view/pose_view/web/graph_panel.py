"""The live graph's controls: how it does; buttons to calibrate, record, choose the person."""

from collections.abc import Sequence
from html import escape
from typing import Protocol

import viser

from pose_view.web.server import LocalServer

ANYBODY = "whoever comes first"


class GraphCommands(Protocol):
    """What the buttons ask the graph for; each returns at once."""

    def calibrate(self) -> None:
        """Begin the calibration of the cameras anew."""

    def record(self, on: bool) -> None:
        """Start or stop recording."""

    def choose_person(self, person: str) -> None:
        """Follow the person of this id; empty: whoever comes first."""


class GraphPanel:
    """Status lines and buttons, in the place that is current.

    Args:
        server: Where it is shown.
        commands: What the buttons do.
    """

    def __init__(self, server: LocalServer, commands: GraphCommands) -> None:
        gui = server.gui
        self._status = gui.add_html("")
        self._calibrate = gui.add_button(
            "Calibrate cameras",
            icon=viser.Icon.FOCUS_2,
            hint="Calibrate the cameras again: walk about, raise the arms",
        )
        self._record = gui.add_button("Start recording", icon=viser.Icon.PLAYER_RECORD, color="red")
        self._person = gui.add_dropdown(
            "Person", (ANYBODY,), hint="Person to track, by the id of the cameras"
        )
        self._answer = gui.add_html("")
        self._is_recording = False

        self._calibrate.on_click(lambda _: commands.calibrate())
        self._record.on_click(lambda _: commands.record(not self._is_recording))

        @self._person.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:  # a visitor's choice, not ours below
                chosen = self._person.value
                commands.choose_person("" if chosen == ANYBODY else chosen)

    def show_status(self, html: str) -> None:
        """The status lines."""
        if self._status.content != html:
            self._status.content = html

    def show_recording(self, bag: str | None) -> None:
        """Where is recorded to, empty if it is not, None if there is no recorder."""
        self._is_recording = bool(bag)
        label = "Stop recording" if bag else "Start recording"
        if self._record.label != label:
            self._record.label = label
        if self._record.disabled != (bag is None):
            self._record.disabled = bag is None

    def offer_persons(self, persons: Sequence[str]) -> None:
        """The ids that the cameras see; the chosen one stays on offer."""
        chosen = self._person.value
        offered = (ANYBODY, *sorted({*persons, *({chosen} - {ANYBODY})}))
        if tuple(self._person.options) != offered:
            self._person.options = offered

    def answer(self, text: str, is_good: bool = True) -> None:
        """What came of the last button."""
        color = "inherit" if is_good else "#d0312d"
        self._answer.content = (
            f'<div style="padding:0 0.75em 0.5em;font-size:0.85em;color:{color}">'
            f"{escape(text)}</div>"
        )
