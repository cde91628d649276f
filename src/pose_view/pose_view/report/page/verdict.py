"""What a reader in a hurry wants to know: how good, how well the views agree, what to do."""

import math

import numpy as np

from pose_core.api import ANGLES
from pose_evaluation.agreement import ViewAgreement
from pose_evaluation.scores import mean_known
from pose_view.report.analysis import Analysis
from pose_view.report.tables.accuracy import method_label

# Of public recordings with two Kinects v2, best rigid fit: 2.3 to 6.6 cm.
WELL_CM, FAIRLY_CM = 5.0, 8.0  # [cm] mean distance of the same joint in two views
EXCESS, EXCESS_CM = 1.5, 2.0  # [-], [cm] over the best rigid fit: the extrinsics are to blame
LONG_GAP_S = 1.0  # [s]


def verdict(analysis: Analysis) -> list[str]:
    """Three sentences."""
    views = analysis.agreement.views
    worst = max(views, key=_distance_cm) if views else None
    return [_how_good(analysis), _how_near(analysis, worst), _what_to_do(analysis, worst)]


def _how_good(analysis: Analysis) -> str:
    focus = analysis.recording.focus
    compared = analysis.compared
    if compared is not None and focus not in compared.left_out:
        found = [f"{method_label(focus)} is {_error(analysis, focus)} from the reference"]
        others = [m.name for m in compared.evaluation.methods if m.name != focus]
        found += [f"{method_label(name)} {_error(analysis, name)}" for name in others]
        return f"{'; '.join(found)} (RMSE, mean of {len(ANGLES)} angles)."
    estimates = analysis.recording.estimates.get(focus)
    text = "There is no reference to compare with"
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
        count = len(analysis.recording.sensors)
        return f"With {'one camera' if count else 'no camera'} there are no two views to compare."
    distance_cm = _distance_cm(view)
    how = "well" if distance_cm <= WELL_CM else "fairly" if distance_cm <= FAIRLY_CM else "badly"
    angles_deg = mean_known(list(view.angle_difference_deg.values()))
    return (
        f"The views of {view.first} and {view.second} agree {how}: the same joint is "
        f"{distance_cm:.1f} cm apart, the same angle {angles_deg:.1f}°."
    )


def _what_to_do(analysis: Analysis, view: ViewAgreement | None) -> str:
    recording = analysis.recording
    if recording.sensors and not recording.T_map_sensor:
        return "Calibrate (./pose calibrate): where the cameras stand is not known."
    if view is not None and view.calibrated_cm > max(
        EXCESS * view.best_rigid_cm, view.best_rigid_cm + EXCESS_CM
    ):
        return (
            f"Calibrate again (./pose calibrate): the views could agree to "
            f"{view.best_rigid_cm:.1f} cm, so a camera has been moved, or its clock is off."
        )
    gap_s = analysis.steadiness[recording.focus].longest_gap_s
    if gap_s > LONG_GAP_S:
        return (
            f"Keep the whole person in view: {method_label(recording.focus)} has gaps of up to "
            f"{gap_s:.1f} s."
        )
    if view is not None and view.best_rigid_cm > FAIRLY_CM:
        return "Look at the cameras: one sees the person half hidden, from behind, or not at all."
    if not recording.segments:
        return "Nothing has to be done; worn IMUs would improve the angles most."
    return "Nothing has to be done."
