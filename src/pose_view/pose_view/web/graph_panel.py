"""Panel of the live graph: status lines; buttons to calibrate, record, select the person."""

from collections.abc import Sequence
from html import escape
from typing import Protocol

import viser

from pose_view.web.server import LocalServer

ANYBODY = "whoever comes first"


class GraphCommands(Protocol):
    """Commands of the buttons; each returns immediately."""

    def calibrate(self) -> None:
        """Restart the calibration of the cameras."""

    def record(self, on: bool) -> None:
        """Start or stop recording."""

    def choose_person(self, person: str) -> None:
        """Select the person of this id; empty: the first one."""


class GraphPanel:
    """Status lines and buttons, added to viser's current container.

    Args:
        server: The server.
        commands: Commands of the buttons.
    """

    def __init__(self, server: LocalServer, commands: GraphCommands) -> None:
        gui = server.gui
        self._status = gui.add_html("")
        hint = "Calibrate the cameras again: walk about, raise the arms"
        self._calibrate = gui.add_button("Calibrate cameras", icon=viser.Icon.FOCUS_2, hint=hint)
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
            if event.client is not None:  # a user's choice, not the assignment below
                chosen = self._person.value
                commands.choose_person("" if chosen == ANYBODY else chosen)

    def show_status(self, html: str) -> None:
        """Show the status lines."""
        self._status.content = html

    def show_recording(self, bag: str | None) -> None:
        """Show the path being recorded: empty if there is none, None without a recorder."""
        self._is_recording = bool(bag)
        self._record.label = "Stop recording" if bag else "Start recording"
        self._record.disabled = bag is None

    def offer_persons(self, persons: Sequence[str]) -> None:
        """Update the choices of the person by the cameras' ids; the selected one is kept."""
        chosen = self._person.value
        offered = (ANYBODY, *sorted({*persons, *({chosen} - {ANYBODY})}))
        if tuple(self._person.options) != offered:
            self._person.options = offered

    def answer(self, text: str, is_good: bool = True) -> None:
        """Show the result of the last command."""
        color = "inherit" if is_good else "#d0312d"
        self._answer.content = (
            f'<div style="padding:0 0.75em 0.5em;font-size:0.85em;color:{color}">'
            f"{escape(text)}</div>"
        )
