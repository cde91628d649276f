"""The sections of the page."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from markupsafe import Markup

from pose_evaluation.gait_cycles import Cycles
from pose_evaluation.table import Table
from pose_evaluation.tables import method_label, readable, stability_table, view_tables
from pose_view.report.analysis import REFERENCE, Analysis
from pose_view.report.figures.agreement import (
    SOURCE_COLOURS,
    bland_altman_figures,
    source_figure,
    uncertainty_figures,
)
from pose_view.report.figures.canvas import FigureSet
from pose_view.report.figures.courses import (
    ROLE_COLOURS,
    angle_figures,
    attitude_figures,
    attitude_sources,
    bone_figures,
    joint_figures,
)
from pose_view.report.figures.cycles import cycle_figures
from pose_view.report.tables.accuracy import (
    accuracy_tables,
    coverage_table,
    overview_table,
)
from pose_view.report.tables.motion import (
    cycle_table,
    peak_table,
    range_table,
    symmetry_table,
)
from pose_view.report.tables.stability import (
    SOURCE_NAMES,
    bone_table,
    jerk_table,
    method_table,
    source_table,
    timing_table,
)

Block = Table | FigureSet | str
"""A table, figures, or a paragraph."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A heading and its content."""

    anchor: str
    title: str
    blocks: Sequence[Block]
    has_methods: bool = False  # whether its figures show methods that can be hidden


def sections(analysis: Analysis, joint: str) -> list[Section]:
    """All sections with content for this recording."""
    compared = analysis.compared
    parts = []
    if compared is not None:
        tables = [overview_table(compared.evaluation), *accuracy_tables(compared.evaluation)]
        parts.append(Section(anchor="accuracy", title="Accuracy", blocks=tables))
    tables = [*view_tables(analysis.agreement), method_table(analysis.angles)]
    parts.append(Section(anchor="agreement", title="Agreement", blocks=tables))
    figures = [angle_figures(analysis)]
    parts.append(
        Section(anchor="angles", title="Angles over time", blocks=figures, has_methods=True)
    )
    if compared is not None and analysis.recording.focus not in compared.left_out:
        figures = [bland_altman_figures(analysis, compared)]
        parts.append(Section(anchor="bland-altman", title="Bland–Altman plots", blocks=figures))
    parts.append(_motion(analysis))
    parts.append(_cycles(analysis))
    if analysis.recording.estimates:
        parts += [_uncertainty(analysis), _sources(analysis)]
    parts += [_attitudes(analysis), _joint(analysis, joint), _stability(analysis)]
    return without_empty(parts)


def without_empty(parts: Iterable[Section]) -> list[Section]:
    """Remove empty tables, and sections without other content."""
    full = [
        replace(part, blocks=[b for b in part.blocks if not (isinstance(b, Table) and b.is_empty)])
        for part in parts
    ]
    return [part for part in full if part.blocks]


def _motion(analysis: Analysis) -> Section:
    of = REFERENCE if analysis.compared is not None else analysis.recording.focus
    shown = list(dict.fromkeys([of, analysis.recording.focus]))
    blocks = [range_table(analysis.ranges)]
    for name in shown:
        blocks += [peak_table(name, analysis.ranges[name])]
        blocks += [symmetry_table(name, analysis.ranges[name])]
    return Section(anchor="motion", title="Range of motion and symmetry", blocks=blocks)


def _cycles(analysis: Analysis) -> Section:
    blocks: list[Block] = []
    for side, cycles in analysis.cycles.items():
        methods = tuple(name for name in analysis.angles if analysis.curves[side].get(name))
        blocks.append(_cycles_text(cycles, analysis.cycles_of))
        blocks.append(cycle_figures(analysis, side))
        blocks.append(cycle_table(side, analysis.curves[side], methods))
    if not blocks:
        blocks.append(
            "No movement was found that repeats at least three times with like length and course."
        )
    return Section(anchor="cycles", title="Cycles", blocks=blocks, has_methods=True)


def _cycles_text(cycles: Cycles, source: str) -> str:
    durations = cycles.durations_s
    return (
        f"{cycles.side.capitalize()}: {len(durations)} cycles of {durations.mean():.2f} ± "
        f"{durations.std(ddof=1):.2f} s ({60.0 / durations.mean():.0f} a minute), found in "
        f"{method_label(source)}; 0 and 100 % are the peaks of {readable(cycles.angle)}."
    )


def _uncertainty(analysis: Analysis) -> Section:
    blocks: list[Block] = []
    line = ""
    if analysis.compared is not None:
        table = coverage_table(analysis.compared.coverage)
        blocks += [] if table is None else [table]
        line = "; black line: the reference"
    blocks.append(f"Dark band: 1 σ, light band: 2 σ{line}.")
    blocks.append(uncertainty_figures(analysis, _account_of(analysis)))
    return Section(anchor="uncertainty", title="Uncertainty", blocks=blocks)


def _sources(analysis: Analysis) -> Section:
    method = _account_of(analysis)
    key = _key((name, SOURCE_COLOURS[source]) for source, name in SOURCE_NAMES.items())
    table = source_table(method, analysis.recording.estimates[method])
    blocks: list[Block] = [key, source_figure(analysis, method), table]
    return Section(anchor="sources", title="Sources", blocks=blocks)


def _key(entries: Iterable[tuple[str, str]]) -> Markup:
    """Names with a sample of their colour."""
    patch = Markup('<span class="swatch" style="background:{}"></span> {}')
    return Markup(", ").join(patch.format(colour, name) for name, colour in entries)


def _account_of(analysis: Analysis) -> str:
    """The method whose uncertainty and sources are shown: the focus, if it has them."""
    estimates = analysis.recording.estimates
    return analysis.recording.focus if analysis.recording.focus in estimates else [*estimates][-1]


def _attitudes(analysis: Analysis) -> Section:
    roles = attitude_sources(analysis)
    key = _key((f"{role} ({method_label(n)})", ROLE_COLOURS[role]) for role, n in roles.items())
    text = key + (
        f"{'; black: the reference' if analysis.compared is not None else ''}. Pitch is the "
        "limb's direction above the horizontal (−90°: it hangs down), yaw its heading in map; "
        "within 15° of the vertical there is no yaw."
    )
    if "IMU" not in roles:
        text += " There is no result of the IMUs alone in this recording."
    blocks: list[Block] = [text, attitude_figures(analysis)] if roles else [text]
    return Section(anchor="attitudes", title="Pitch, yaw and roll of the limbs", blocks=blocks)


def _joint(analysis: Analysis, joint: str) -> Section:
    text = "All in map; the reference is moved by one rotation and translation onto "
    text += f"{method_label(analysis.recording.focus)}."
    has_joints = analysis.compared is not None and analysis.compared.joints is not None
    blocks = [joint_figures(analysis, joint)]
    return Section(
        anchor="joint",
        title=f"Path of the {readable(joint)}",
        blocks=[text, *blocks] if has_joints else blocks,
        has_methods=True,
    )


def _stability(analysis: Analysis) -> Section:
    blocks: list[Block] = [stability_table(analysis.stability)]
    if analysis.recording.estimates:
        blocks.append(timing_table(analysis.recording.estimates))
    blocks += [bone_figures(analysis), bone_table(analysis.stability)]
    blocks.append(jerk_table(analysis.stability))
    return Section(anchor="stability", title="Stability", blocks=blocks, has_methods=True)
