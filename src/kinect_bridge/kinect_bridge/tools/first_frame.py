"""The picture that ``inspect`` draws of a recording's first frame."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pose_core.arrays import FloatArray
from pose_core.errors import writing
from pose_core.joints import JOINT_INDEX, SKELETON_LINES, TrackingState
from pose_io.arrays import ByteArray
from pose_io.recordings.recording import Recording, SensorStream

COLOURS = {"left": "#0072b2", "right": "#d55e00"}  # of the person's sides
MIDDLE_COLOUR = "#444444"
VIEWS = (("from the sensor", 0, 1), ("from above", 0, 2))  # title and axes of the optical frame
AXES = ("x right [m]", "y down [m]", "z forward [m]")
MAX_SENSORS = 8  # largest number drawn


def draw_first_frames(recording: Recording, path: Path) -> None:
    """Write a PNG of the first frame: each sensor's view and the view from above.

    Raises:
        InputError: If the file cannot be written.
    """
    streams = recording.streams[:MAX_SENSORS]
    figure = Figure(figsize=(4.5 * len(streams), 8.0), layout="constrained")
    axes = figure.subplots(len(VIEWS), len(streams), squeeze=False)
    for column, stream in enumerate(streams):
        for row, view in enumerate(VIEWS):
            _draw(axes[row, column], stream, view)
    figure.suptitle(f"{Path(recording.source).name}: format {recording.format}")
    with writing(path):
        figure.savefig(path, format="png", dpi=80)


def _draw(axes: Axes, stream: SensorStream, view: tuple[str, int, int]) -> None:
    title, across, up = view
    frame = next((i for i in range(len(stream)) if len(stream.rows(i))), None)
    axes.set_title(f"{stream.name[:40]}, {title}", fontsize=9)
    if frame is None:
        axes.text(0.5, 0.5, "nobody was seen", transform=axes.transAxes, ha="center")
        return
    for row in stream.rows(frame):
        person = stream.positions[row][:, [across, up]]
        _draw_person(axes, person, stream.tracking_state[row])
        seen = person[np.isfinite(person).all(axis=1)]
        if len(seen):
            axes.annotate(stream.person[row][:20], seen[0], fontsize=8)
    axes.set(xlabel=AXES[across], ylabel=AXES[up], aspect="equal")
    axes.margins(0.2)
    if AXES[up].startswith("y"):
        axes.invert_yaxis()
    axes.grid(alpha=0.3)


def _draw_person(axes: Axes, places: FloatArray, states: ByteArray) -> None:
    """Draw lines in the colours of the sides, dashed if a joint is not TRACKED."""
    for start, end in SKELETON_LINES:
        ends = [JOINT_INDEX[start], JOINT_INDEX[end]]
        tracked = (states[ends] == TrackingState.TRACKED).all()
        x, y = places[ends].T
        colour = COLOURS.get(end.partition("_")[0], MIDDLE_COLOUR)
        axes.plot(x, y, "o-" if tracked else "o--", color=colour, markersize=3)
