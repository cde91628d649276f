"""CSV files with the report's numbers."""

from collections.abc import Iterable, Mapping
from dataclasses import astuple

import numpy as np

from pose_core.api import ANGLES
from pose_evaluation.gait_cycles import PERCENT
from pose_evaluation.tables import agreement_csv, csv_text, evaluation_csv
from pose_evaluation.uncertainty import Coverage
from pose_view.report.analysis import Analysis
from pose_view.report.report_data import seconds


def csv_files(analysis: Analysis) -> dict[str, str]:
    """Contents by file name."""
    files = {
        "agreement.csv": agreement_csv(
            analysis.views, analysis.stability, synthetic=analysis.is_synthetic
        ),
        "motion.csv": _motion(analysis),
        "angles.csv": _angles(analysis),
    }
    if analysis.compared is not None:
        files["evaluation.csv"] = evaluation_csv(analysis.compared.evaluation)
        files["uncertainty.csv"] = _uncertainty(analysis, analysis.compared.coverage)
    if analysis.cycles:
        files["cycles.csv"] = _cycles(analysis)
    return files


def _motion(analysis: Analysis) -> str:
    rows = [
        (method, angle, *astuple(each), each.range_deg)
        for method, ranges in analysis.ranges.items()
        for angle, each in ranges.items()
    ]
    head = ("method", "angle", "lowest_deg", "lowest_s", "highest_deg", "highest_s", "range_deg")
    return _text(analysis, head, rows)


def _angles(analysis: Analysis) -> str:
    """Angles of every method at its own instants."""
    rows: list[tuple[object, ...]] = []
    for method, series in analysis.angles.items():
        times = seconds(series.stamps_ns, analysis.recording.begin_ns)
        angles = np.degrees([series.angles[name] for name in ANGLES]).T
        rows += [(method, time, *values) for time, values in zip(times, angles, strict=True)]
    return _text(analysis, ("method", "time_s", *(f"{name}_deg" for name in ANGLES)), rows)


def _uncertainty(analysis: Analysis, coverage: Mapping[str, Mapping[str, Coverage]]) -> str:
    rows = [
        (method, angle, each.within_1, each.within_2, each.mean_stddev_deg, each.samples)
        for method, angles in coverage.items()
        for angle, each in angles.items()
    ]
    head = ("method", "angle", "within_1_sigma", "within_2_sigma", "mean_sigma_deg", "samples")
    return _text(analysis, head, rows)


def _cycles(analysis: Analysis) -> str:
    rows = [
        (side, method, angle, percent, mean, sd, curve.cycles)
        for side, methods in analysis.curves.items()
        for method, curves in methods.items()
        for angle, curve in curves.items()
        for percent, mean, sd in zip(PERCENT, curve.mean_deg, curve.sd_deg, strict=True)
    ]
    head = ("side", "method", "angle", "cycle_percent", "mean_deg", "sd_deg", "cycles")
    return _text(analysis, head, rows)


def _text(analysis: Analysis, head: tuple[str, ...], rows: Iterable[tuple[object, ...]]) -> str:
    """Format a table; every line states whether the subject is simulated."""
    subject = "simulated" if analysis.is_synthetic else "recorded"
    return csv_text(("subject", *head), ((subject, *row) for row in rows))
