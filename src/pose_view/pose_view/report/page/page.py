"""The page: one HTML file with embedded style and figures, without scripts."""

import math
from collections.abc import Sequence
from datetime import datetime, timezone

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from pose_core.api import TrackedJoints
from pose_core.finite_numbers import mean_known
from pose_core.stamps import NS_PER_S
from pose_evaluation.agreement import ViewAgreement
from pose_evaluation.methods import FUSED, MEAN
from pose_evaluation.offline import IMU_ENDING
from pose_evaluation.table import Table, number
from pose_evaluation.tables import method_label, readable
from pose_evaluation.unseen import unseen_line
from pose_view.report.analysis import REFERENCE, Analysis
from pose_view.report.figures.canvas import METHODS, FigureSet, group_of, method_style
from pose_view.report.figures.courses import legend
from pose_view.report.page.sections import Section, sections

# Of public recordings with two Kinects v2, best rigid fit: 2.3 to 6.6 cm.
WELL_CM, FAIRLY_CM = 5.0, 8.0  # [cm] mean distance of the same joint in two views
EXCESS, EXCESS_CM = 1.5, 2.0  # [-], [cm] above the best rigid fit: the extrinsics are wrong
LONG_GAP_S = 1.0  # [s]
RAW = "raw skeletons (kinect_<name>/skeletons)"

CAMERA = ("", "one camera, as it is")
EARLIEST_NS = 1_262_304_000 * 1_000_000_000  # [ns] 2010, the first Kinect's year: before, no dates


def verdict(analysis: Analysis) -> list[str]:
    """Summary in three sentences."""
    views = analysis.views
    worst = max(views, key=_distance_cm) if views else None
    return [_how_good(analysis), _how_near(analysis, worst), _what_to_do(analysis, worst)]


def _how_good(analysis: Analysis) -> str:
    focus = analysis.recording.focus
    compared = analysis.compared
    if compared is not None and focus not in compared.left_out:
        count = compared.evaluation.angle_count
        found = [f"{method_label(focus)} is {_error(analysis, focus)} from the reference"]
        others = [m.name for m in compared.evaluation.methods if m.name != focus]
        found += [f"{method_label(name)} {_error(analysis, name)}" for name in others]
        return f"{'; '.join(found)} (RMSE, mean of {count} angles)."
    estimates = analysis.recording.estimates.get(focus)
    text = "There is no reference to compare with"
    if compared is not None:
        begin_ns, end_ns = (int(ns) for ns in compared.reference.stamps_ns[[0, -1]])
        common_s = analysis.recording.methods[focus].between(begin_ns, end_ns).duration_s
        text = (
            f"{method_label(focus)} is not compared with the reference, with which it has only "
            f"{common_s:.1f} s in common"
        )
    if estimates is None:
        return f"{text}, so how good the angles are is not known."
    angles = [not name.startswith("pelvis_") for name in estimates.names]
    stddev_deg = np.degrees(np.median(estimates.position_stddev[:, angles]))
    return f"{text}: {method_label(focus)} itself expects errors of {stddev_deg:.1f}° (median)."


def _error(analysis: Analysis, name: str) -> str:
    assert analysis.compared is not None
    return f"{analysis.compared.evaluation.method(name).mean_rmse_deg:.1f}°"


def _distance_cm(view: ViewAgreement) -> float:
    return view.as_logged_cm if math.isnan(view.calibrated_cm) else view.calibrated_cm


def _how_near(analysis: Analysis, view: ViewAgreement | None) -> str:
    if view is None:
        if not analysis.recording.sensors:
            return f"The recording holds no {RAW}: there are no views to compare."
        return "With one camera there are no two views to compare."
    distance_cm = _distance_cm(view)
    how = "well" if distance_cm <= WELL_CM else "fairly" if distance_cm <= FAIRLY_CM else "badly"
    angles_deg = mean_known(list(view.angle_difference_deg.values()))
    return (
        f"The views of {view.first} and {view.second} agree {how}: the same joint is "
        f"{distance_cm:.1f} cm apart, the same angle {angles_deg:.1f}°."
    )


def _what_to_do(analysis: Analysis, view: ViewAgreement | None) -> str:
    recording, compared = analysis.recording, analysis.compared
    if compared is not None and compared.alignment.is_doubtful:
        return (
            f"Check the reference {compared.reference.name}: it fits the recording weakly "
            f"(r = {number(compared.alignment.correlation, 2)}), and at other instants as well; it "
            "may show another motion."
        )
    if recording.sensors and not recording.T_map_sensor:
        return "Calibrate (./pose calibrate): where the cameras stand is not known."
    if view is not None and view.calibrated_cm > max(
        EXCESS * view.best_rigid_cm, view.best_rigid_cm + EXCESS_CM
    ):
        return (
            f"Calibrate again (./pose calibrate): the views could agree to "
            f"{view.best_rigid_cm:.1f} cm, so a camera has been moved, or its clock is off."
        )
    gap_s = analysis.stability[recording.focus].longest_gap_s
    if gap_s > LONG_GAP_S:
        return (
            f"Keep the whole person in view: {method_label(recording.focus)} has gaps of up to "
            f"{gap_s:.1f} s."
        )
    if view is not None and view.best_rigid_cm > FAIRLY_CM:
        return "Look at the cameras: one sees the person half hidden, from behind, or not at all."
    if missing := _missing_joints(analysis):
        return f"Let a camera see {missing}: none tracks it, so the angles there are guesses."
    if nearer := _nearer_than_focus(analysis):
        return (
            f"{nearer} is nearer to the reference than {method_label(recording.focus)}: look at "
            "the mean errors, which differ where joints are defined differently."
        )
    if recording.unused_imus:
        names = ", ".join(n if "/" in n else readable(n) for n in recording.unused_imus)
        return f"Look at the IMUs that are not used ({names}): the notes say why."
    if not recording.sensors:
        return f"To compare the views, record or keep the {RAW} beside the fused pose."
    if not recording.segments:
        return "Nothing has to be done; worn IMUs would improve the angles most."
    return "Nothing has to be done."


def _missing_joints(analysis: Analysis) -> str:
    """Joints that no camera tracks, as text."""
    tracked = TrackedJoints()
    for view in analysis.recording.views.values():
        tracked.add(view.tracking_state)
    return ", ".join(name.replace("_", " ") for name in tracked.missing)


def _nearer_than_focus(analysis: Analysis) -> str:
    """The method with the smallest error to the reference, if that is another than the focus."""
    compared, focus = analysis.compared, analysis.recording.focus
    if compared is None or focus in compared.left_out:
        return ""
    known = [each for each in compared.evaluation.methods if math.isfinite(each.mean_rmse_deg)]
    best = min(known, key=lambda method: method.mean_rmse_deg, default=None)
    return "" if best is None or best.name == focus else method_label(best.name)


def render_page(analysis: Analysis, joint: str) -> str:
    """The report as HTML; the same analysis gives the same bytes.

    Args:
        analysis: The figures.
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
    parts, template = sections(analysis, joint), environment.get_template("report.html.jinja")
    return template.render(
        title=f"Report: {analysis.recording.name}",
        is_synthetic=analysis.is_synthetic,
        verdict=verdict(analysis),
        facts=facts(analysis),
        notes=notes(analysis),
        said=analysis.recording.said,
        sections=parts,
        methods=_methods(analysis, parts),
    )


def facts(analysis: Analysis) -> list[tuple[str, str]]:
    """Description of the recording, line by line."""
    recording = analysis.recording
    lines = [("recording", recording.name)]
    if recording.begin_ns >= EARLIEST_NS:
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
        begin_s = number(alignment.begins_at_s, 3, sign=True)
        text = (
            f"its first frame was put {begin_s} s after the recording's, by cross-correlation of "
            f"the angles (r = {number(alignment.correlation, 3)}; the next best place has "
            f"{number(alignment.next_best, 3)}); lags are therefore relative to "
            f"{method_label(compared.aligned_with)}"
        )
    what = "joints and angles" if compared.reference.skeleton is not None else "angles alone"
    return [("reference", f"{compared.reference.name} ({what})"), ("aligned in time", text)]


def notes(analysis: Analysis) -> list[str]:
    """Remarks that qualify the numbers."""
    found = list(analysis.recording.notes)
    focus, begin_ns = analysis.recording.focus, analysis.recording.begin_ns
    if focus in analysis.recording.estimates:
        estimates = analysis.recording.estimates[focus]
        end_ns = begin_ns + round(analysis.recording.duration_s * NS_PER_S)
        sources = np.bitwise_or.reduce(estimates.source, axis=1)
        if line := unseen_line(estimates.stamps_ns, sources, begin_ns, end_ns):
            found.append(f"{method_label(focus)}: {line}.")
    if analysis.compared is not None:
        if analysis.compared.left_out:
            names = ", ".join(method_label(name) for name in analysis.compared.left_out)
            found.append(f"{names}: too little in common with the reference, not compared with it.")
        name = analysis.compared.reference.name
        found += [f"{name}: {note}." for note in analysis.compared.reference.notes]
    return found


def _methods(analysis: Analysis, parts: Sequence[Section]) -> list[dict[str, object]]:
    """Check boxes to show and hide methods."""
    if not any(part.has_methods for part in parts):
        return []
    sensors = analysis.recording.sensors
    shown = {REFERENCE, MEAN, "default", "default+imus", FUSED, analysis.recording.focus}
    return [
        {
            "name": text,
            "meaning": METHODS.get(name.removesuffix(IMU_ENDING), CAMERA)[1]
            + (", with the IMUs weighted in" if name.endswith(IMU_ENDING) else ""),
            "group": group_of(name),
            "colour": method_style(name, sensors)["color"],
            "is_dashed": method_style(name, sensors).get("linestyle", "-") != "-",
            "is_shown": name in shown or (len(analysis.angles) <= 4),
        }
        for name, text in legend(analysis).items()
    ]
