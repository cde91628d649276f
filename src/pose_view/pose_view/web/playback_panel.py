"""Playback controls of a recording: play, pause, seek, rate."""

import time
from html import escape
from pathlib import Path

import viser

from pose_core.stamps import NS_PER_S
from pose_io.playback import PlaybackClock
from pose_view.web.page_style import SLIDER_STYLE
from pose_view.web.server import LocalServer

RATES = {"⅛ speed": 0.125, "¼ speed": 0.25, "½ speed": 0.5, "as it was": 1.0, "2 × faster": 2.0}
STEPS_S = {"|◀": None, "◀": -1.0 / 30.0, "▶": 1.0 / 30.0}  # [s] of the buttons
SLIDER_STEP_S = 0.01  # [s]
HANDS_OFF_S = 0.6  # [s] after the user's last move, until the slider follows the time again


class PlaybackPanel:
    """Buttons and a slider, with the recording's clock, added to viser's current container.

    Args:
        server: The server.
        path: Path of the recording.
        duration_s: Duration of the recording [s].
    """

    def __init__(self, server: LocalServer, path: Path, duration_s: float) -> None:
        self._duration_s = duration_s
        self._clock = PlaybackClock(0, 1.0, paused=False, now_ns=time.monotonic_ns())
        self._written_s = self._touched_s = 0.0
        gui = server.gui
        gui.add_html(f"<b>{escape(path.name)}</b>, {duration_s:.1f} s{SLIDER_STYLE}")
        self._slider = gui.add_slider(
            "Time [s]", 0.0, max(round(duration_s, 2), SLIDER_STEP_S), SLIDER_STEP_S, 0.0
        )
        self._play = gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
        step = gui.add_button_group(
            "Step", tuple(STEPS_S), hint="To the start; a thirtieth of a second back or on"
        )
        shown = min(RATES, key=lambda name: abs(RATES[name] - 1.0))
        self._rate = gui.add_dropdown("Speed", tuple(RATES), initial_value=shown)
        self._play.on_click(lambda _: self._toggle())
        self._rate.on_update(
            lambda _: self._clock.change_rate(RATES[self._rate.value], time.monotonic_ns())
        )
        step.on_click(lambda _: self._step(step.value))

    def time_s(self) -> float:
        """The time to show, after the recording's start [s]; restarts at the end.

        The slider is read here and not in viser's callback, which is called later in another
        thread: the assignment below would otherwise undo a user's move.
        """
        moved_to_s = self._slider.value
        if moved_to_s != self._written_s:
            self._written_s, self._touched_s = moved_to_s, time.monotonic()
            self._jump(moved_to_s)
        position_s = self._clock.position_ns(time.monotonic_ns()) / NS_PER_S
        if position_s > self._duration_s:
            self._clock.jump(0, time.monotonic_ns())
            position_s = 0.0
        if time.monotonic() - self._touched_s > HANDS_OFF_S:
            shown = min(round(position_s, 2), self._slider.max)
            if shown != self._written_s:
                self._written_s = shown
                self._slider.value = shown  # type: ignore[misc]  # viser's property can be set
        return position_s

    def _toggle(self) -> None:
        if self._clock.paused:
            self._clock.resume(time.monotonic_ns())
        else:
            self._clock.pause(time.monotonic_ns())
        self._show_state()

    def _step(self, what: str) -> None:
        self._clock.pause(time.monotonic_ns())
        self._show_state()
        position_s = self._clock.position_ns(time.monotonic_ns()) / NS_PER_S
        step_s = STEPS_S[what]
        self._jump(0.0 if step_s is None else position_s + step_s)

    def _jump(self, time_s: float) -> None:
        time_s = min(max(time_s, 0.0), self._duration_s)
        self._clock.jump(round(time_s * NS_PER_S), time.monotonic_ns())

    def _show_state(self) -> None:
        paused = self._clock.paused
        self._play.label = "Play" if paused else "Pause"
        self._play.icon = viser.Icon.PLAYER_PLAY if paused else viser.Icon.PLAYER_PAUSE
