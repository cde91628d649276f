"""The sections of the page."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from markupsafe import Markup

from pose_evaluation.gait_cycles import Cycles
from pose_evaluation.methods import FUSED
from pose_evaluation.table import Table
from pose_evaluation.tables import method_label, readable, stability_table, view_tables
from pose_view.report.analysis import REFERENCE, Analysis
from pose_view.report.figures import agreement, courses
from pose_view.report.figures.canvas import FigureSet
from pose_view.report.tables import accuracy, motion, stability

LONG_S = 120.0  # [s] of a recording whose curves show little detail

Block = Table | FigureSet | str
"""A table, figures, or a paragraph."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A heading and its content."""

    anchor: str
    title: str
    blocks: Iterable[Block]
    has_methods: bool = False  # whether its figures show methods that can be hidden


def sections(analysis: Analysis, joint: str) -> list[Section]:
    """All sections with content for this recording."""
    path = f"Path of the {readable(joint)}"
    parts = (  # anchor, title, content, whether methods can be hidden
        ("accuracy", "Accuracy", _accuracy(analysis), False),
        ("agreement", "Agreement", _agreement(analysis), False),
        ("angles", "Angles over time", _angles(analysis), True),
        ("bland-altman", "Bland–Altman plots", _bland_altman(analysis), False),
        ("motion", "Range of motion and symmetry", _motion(analysis), False),
        ("cycles", "Cycles", _cycles(analysis), True),
        ("uncertainty", "Uncertainty", _uncertainty(analysis), False),
        ("sources", "Sources", _sources(analysis), False),
        ("attitudes", "Pitch, yaw and roll of the limbs", _attitudes(analysis), False),
        ("joint", path, _joint(analysis, joint), True),
        ("stability", "Stability", _stability(analysis), True),
    )
    return without_empty(
        Section(anchor=anchor, title=title, blocks=blocks, has_methods=has_methods)
        for anchor, title, blocks, has_methods in parts
    )


def without_empty(parts: Iterable[Section]) -> list[Section]:
    """Remove empty tables, and sections without other content."""
    full = [
        replace(part, blocks=[b for b in part.blocks if not (isinstance(b, Table) and b.is_empty)])
        for part in parts
    ]
    return [part for part in full if part.blocks]


def _accuracy(analysis: Analysis) -> Iterator[Block]:
    if analysis.compared is not None:
        yield accuracy.overview_table(analysis.compared.evaluation)
        yield from accuracy.accuracy_tables(analysis.compared.evaluation)


def _agreement(analysis: Analysis) -> Iterator[Block]:
    yield from view_tables(analysis.views)
    yield stability.method_table(analysis.angles)


def _angles(analysis: Analysis) -> Iterator[Block]:
    if analysis.recording.duration_s > LONG_S:
        yield (
            "A long recording hides single movements: report --from 60 --until 90 shows half a "
            "minute of it, for example."
        )
    yield courses.angle_figures(analysis)


def _bland_altman(analysis: Analysis) -> Iterator[Block]:
    compared = analysis.compared
    if compared is not None and analysis.recording.focus not in compared.left_out:
        yield agreement.bland_altman_figures(analysis, compared)


def _motion(analysis: Analysis) -> Iterator[Block]:
    of = REFERENCE if analysis.compared is not None else analysis.recording.focus
    yield motion.range_table(analysis.ranges)
    for name in dict.fromkeys([of, analysis.recording.focus]):
        yield motion.peak_table(name, analysis.ranges[name])
        yield motion.symmetry_table(name, analysis.ranges[name])


def _cycles(analysis: Analysis) -> Iterator[Block]:
    for side, cycles in analysis.cycles.items():
        methods = tuple(name for name in analysis.angles if analysis.curves[side].get(name))
        yield _cycles_text(cycles, analysis.cycles_of)
        yield courses.cycle_figures(analysis, side)
        yield motion.cycle_table(side, analysis.curves[side], methods)
    if not analysis.cycles:
        yield "No movement was found that repeats at least three times with like length and course."


def _cycles_text(cycles: Cycles, source: str) -> str:
    durations = cycles.durations_s
    return (
        f"{cycles.side.capitalize()}: {len(durations)} cycles of {durations.mean():.2f} ± "
        f"{durations.std(ddof=1):.2f} s ({60.0 / durations.mean():.0f} a minute), found in "
        f"{method_label(source)}; 0 and 100 % are the peaks of {readable(cycles.angle)}."
    )


def _uncertainty(analysis: Analysis) -> Iterator[Block]:
    if not analysis.recording.estimates:
        return
    line = ""
    if analysis.compared is not None:
        line = "; black line: the reference"
        table = accuracy.coverage_table(analysis.compared.coverage)
        if table is not None:
            yield table
    yield f"Dark band: 1 σ, light band: 2 σ{line}."
    yield agreement.uncertainty_figures(analysis, _account_of(analysis))


def _sources(analysis: Analysis) -> Iterator[Block]:
    if analysis.recording.estimates:
        method = _account_of(analysis)
        yield _key(stability.SOURCES.values())
        yield agreement.source_figure(analysis, method)
        yield stability.source_table(method, analysis.recording.estimates[method])


def _key(entries: Iterable[tuple[str, str]]) -> Markup:
    """Names with a sample of their colour."""
    patch = Markup('<span class="swatch" style="background:{}"></span> {}')
    return Markup(", ").join(patch.format(colour, name) for name, colour in entries)


def _account_of(analysis: Analysis) -> str:
    """The method whose uncertainty and sources are shown: the focus, if it has them."""
    estimates = analysis.recording.estimates
    return analysis.recording.focus if analysis.recording.focus in estimates else [*estimates][-1]


def _attitudes(analysis: Analysis) -> Iterator[Block]:
    roles, recording = courses.attitude_sources(analysis), analysis.recording
    meanings = {role: method_label(name) for role, name in roles.items()}
    if courses.PAPER in roles:
        meanings[courses.PAPER] = "the paper's mean of that Kinect and the IMUs"
    if roles.get("fused") == FUSED:
        by = f", estimator {recording.fused_by}" if recording.fused_by else ""
        meanings["fused"] = f"in the recording{by}"
    key = [(f"{role}: {text}", courses.ROLE_COLOURS[role]) for role, text in meanings.items()]
    if "Kinect" in roles:
        key.append(("that Kinect does not track both ends of the limb", courses.OCCLUDED))
    text = _key(key) + (
        f"{'; black: the reference' if analysis.compared is not None else ''}. Pitch is the "
        "limb's direction above the horizontal (−90°: it hangs down), yaw its heading in map; "
        "within 15° of the vertical there is no yaw."
    )
    if "IMUs" not in roles:
        text += (
            " The IMUs alone are not shown: no IMU could be used, or --methods lacks imu."
            if recording.segments
            else " The recording holds no IMUs."
        )
    yield text
    if roles:
        yield courses.attitude_figures(analysis)


def _joint(analysis: Analysis, joint: str) -> Iterator[Block]:
    if analysis.compared is not None and analysis.compared.joints is not None:
        focus = method_label(analysis.recording.focus)
        yield f"All in map; the reference is moved by one rotation and translation onto {focus}."
    yield courses.joint_figures(analysis, joint)


def _stability(analysis: Analysis) -> Iterator[Block]:
    yield stability_table(analysis.stability)
    if analysis.recording.estimates:
        yield stability.timing_table(analysis.recording.estimates)
    yield courses.bone_figures(analysis)
    yield stability.bone_table(analysis.stability)
    yield stability.jerk_table(analysis.stability)
