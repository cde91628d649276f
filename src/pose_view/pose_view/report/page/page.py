"""The page itself: one file of HTML with its style and drawings inside, without any script."""

from collections.abc import Sequence
from datetime import datetime, timezone

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from pose_evaluation.methods import FUSED, MEAN
from pose_evaluation.offline import IMU_ENDING
from pose_view.report.analysis import REFERENCE, Analysis
from pose_view.report.figures.canvas import group_of, method_style
from pose_view.report.figures.courses import legend
from pose_view.report.figures.figure import FigureSet
from pose_view.report.page.section import Section
from pose_view.report.page.sections import sections
from pose_view.report.page.verdict import verdict
from pose_view.report.tables.accuracy import method_label
from pose_view.report.tables.table import Table

MEANINGS = {
    REFERENCE: "what it is compared with",
    MEAN: "of all cameras, without a filter",
    FUSED: "what the recording itself holds",
    "joint_kf": "a linear Kalman filter for each joint's position (Moon et al. 2016)",
    "dof_kf": "a linear Kalman filter on joint angles (the ablation of Li et al.)",
    "li2020": "the unscented filter on a kinematic tree of Li et al. (2020)",
    "zhang2015": "cameras and IMUs weighted by their variances (Zhang et al. 2015)",
    "default": "this project's unscented filter",
    "smoothed": "the same, which looks ahead too",
    "ukf": "the default by its other name",
    "imu": "the IMUs alone",
}
"""What each method is; the others are cameras."""

DAY = 24 * 3600 * 1_000_000_000  # [ns] stamps below it are no dates


def render_page(analysis: Analysis, joint: str) -> str:
    """The report as HTML; the same analysis gives the same bytes.

    Args:
        analysis: What was measured.
        joint: The joint whose path is shown.
    """
    environment = Environment(
        loader=PackageLoader("pose_view.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.tests["figures"] = lambda block: isinstance(block, FigureSet)
    environment.filters["safe_html"] = Markup
    parts = sections(analysis, joint)
    return environment.get_template("report.html.jinja").render(
        title=f"Report: {analysis.recording.name}",
        is_synthetic=analysis.is_synthetic,
        verdict=verdict(analysis),
        facts=facts(analysis),
        notes=notes(analysis),
        sections=parts,
        contents=[(part.anchor, part.title) for part in parts],
        methods=_methods(analysis, parts),
    )


def facts(analysis: Analysis) -> list[tuple[str, str]]:
    """What was recorded, line by line."""
    recording = analysis.recording
    lines = [("recording", recording.name)]
    if recording.begin_ns > 365 * DAY:
        begin = datetime.fromtimestamp(recording.begin_ns // 1_000_000_000, tz=timezone.utc)
        lines.append(("begins", f"{begin:%Y-%m-%d %H:%M:%S} UTC"))
    lines.append(("length", f"{recording.duration_s:.1f} s"))
    if recording.comment:
        lines.append(("its source says", recording.comment))
    lines.append(("Kinects", ", ".join(recording.sensors) or "none"))
    segments = ", ".join(name.replace("_", " ") for name in recording.segments)
    lines.append(("IMUs", f"{len(recording.segments)}: {segments}" if segments else "none"))
    lines.append(("figures of one method show", method_label(recording.focus)))
    lines += _reference_facts(analysis)
    return lines


def _reference_facts(analysis: Analysis) -> list[tuple[str, str]]:
    compared = analysis.compared
    if compared is None:
        return [("reference", "none: methods are compared with one another")]
    alignment = compared.alignment
    if alignment.shares_clock:
        text = "its stamps are the recording's own; nothing was moved"
    else:
        text = (
            (
                f"its first frame was put {alignment.begins_at_s:+.3f} s after the recording's, by "
                f"cross-correlation of the angles (r = {alignment.correlation:.3f}; the next best "
                f"place has {alignment.next_best:.3f}); lags are therefore relative to "
                f"{method_label(compared.aligned_with)}"
            )
            .replace("-", "−")
            .replace("cross−", "cross-")
        )
    what = "joints and angles" if compared.reference.skeleton is not None else "angles alone"
    return [("reference", f"{compared.reference.name} ({what})"), ("aligned in time", text)]


def notes(analysis: Analysis) -> list[str]:
    """Remarks that qualify the numbers."""
    found = list(analysis.recording.notes)
    if analysis.compared is not None:
        if analysis.compared.left_out:
            names = ", ".join(method_label(name) for name in analysis.compared.left_out)
            found.append(f"{names}: too little in common with the reference, not compared with it.")
        name = analysis.compared.reference.name
        found += [f"{name}: {note}." for note in analysis.compared.reference.notes]
    return found


def _methods(analysis: Analysis, parts: Sequence[Section]) -> list[dict[str, object]]:
    """The switches by which methods are shown and hidden."""
    if not any(part.has_methods for part in parts):
        return []
    sensors = analysis.recording.sensors
    shown = {REFERENCE, MEAN, "default", "default+imus", FUSED, analysis.recording.focus}
    return [
        {
            "name": text,
            "meaning": MEANINGS.get(name.removesuffix(IMU_ENDING), "one camera, as it is")
            + (", with the IMUs weighted in" if name.endswith(IMU_ENDING) else ""),
            "group": group_of(name),
            "colour": method_style(name, sensors)["color"],
            "is_dashed": method_style(name, sensors).get("linestyle", "-") != "-",
            "is_shown": name in shown or (len(analysis.angles) <= 4),
        }
        for name, text in legend(analysis).items()
    ]
