"""Tables without a reference: agreement of the views, bones, jerk, sources."""

from collections.abc import Mapping

import numpy as np

from pose_core.api import ANGLES, AngleSeries, EstimateSeries, Source
from pose_core.finite_numbers import mean_known
from pose_core.joints import JOINTS, SIDES
from pose_evaluation.agreement import (
    Agreement,
    Steadiness,
    ViewAgreement,
    angle_differences_deg,
)
from pose_evaluation.stability import BONES
from pose_evaluation.tables import readable
from pose_view.report.tables.accuracy import method_label
from pose_view.report.tables.table import (
    Table,
    number,
    number_row,
    smallest,
    text_row,
)

SOURCE_NAMES = {
    Source.KINECT: "Kinect",
    Source.FUSED: "Kinect and IMU",
    Source.IMU: "IMU",
    Source.PREDICTED: "predicted",
}


def view_tables(agreement: Agreement) -> list[Table]:
    """Agreement of the sensors."""
    if not agreement.views:
        return []
    distance = Table(
        caption="Mean distance of the same joint in two views [cm]",
        head="views",
        columns=("as logged", "calibrated", "best rigid fit", "angles, RMS [deg]", "instants"),
        rows=tuple(
            text_row(
                f"{view.first} – {view.second}",
                number(view.as_logged_cm, 1),
                number(view.calibrated_cm, 1),
                number(view.best_rigid_cm, 1),
                number(mean_known(list(view.angle_difference_deg.values())), 1),
                str(view.frames),
            )
            for view in agreement.views
        ),
        note="The best rigid fit to the same data is the lower bound for any calibration.",
    )
    return [distance, *(_difference_table(view) for view in agreement.views)]


def method_table(angles: Mapping[str, AngleSeries]) -> Table:
    """Differences between the methods and the reference."""
    differences = angle_differences_deg(angles)
    return Table(
        caption="Difference of the methods: RMS, mean of 12 angles [deg]",
        head="method",
        columns=tuple(method_label(name) for name in angles),
        rows=tuple(
            number_row(
                method_label(first),
                [differences.get((first, second), np.nan) for second in angles],
                1,
            )
            for first in angles
        ),
        note="Each pair over its common time; no lag is removed.",
    )


def steadiness_table(steadiness: Mapping[str, Steadiness]) -> Table:
    """Frames, gaps, bones and jerk of every method."""
    return Table(
        caption="Steadiness of each method",
        head="method",
        columns=(
            "frames",
            "gaps > 0.2 s",
            "longest gap [s]",
            "bone length SD [mm]",
            "bone length CV [%]",
            "jerk, RMS [m/s³]",
        ),
        rows=tuple(
            text_row(
                method_label(name),
                str(each.frames),
                str(each.gaps),
                number(each.longest_gap_s, 1),
                number(each.mean_bone_sd_mm, 1),
                number(each.mean_bone_cv_percent, 1),
                number(each.mean_jerk, 0),
            )
            for name, each in steadiness.items()
        ),
        note="The bones of li2020 and zhang2015 are constant by construction; the default lets "
        "shoulders, hips, knees and feet slide.",
    )


def bone_table(steadiness: Mapping[str, Steadiness]) -> Table:
    """Standard deviation of each bone's length."""
    return _by_part(
        "Standard deviation of the bones' lengths [mm]",
        "bone",
        tuple(BONES),
        {name: each.bone_sd_mm for name, each in steadiness.items()},
        digits=1,
    )


def jerk_table(steadiness: Mapping[str, Steadiness]) -> Table:
    """RMS jerk of each joint."""
    return _by_part(
        "RMS jerk of the joints [m/s³], at 30 Hz",
        "joint",
        JOINTS,
        {name: each.jerk for name, each in steadiness.items()},
        digits=0,
    )


def timing_table(estimates: Mapping[str, EstimateSeries]) -> Table:
    """Latency of each method."""
    return Table(
        caption="Latency: from the newest sample's capture to the result [ms]",
        head="method",
        columns=("median", "99 %", "longest"),
        rows=tuple(
            number_row(
                method_label(name),
                [1000.0 * float(q) for q in np.percentile(each.latency_s, [50, 99, 100])],
                0,
            )
            for name, each in estimates.items()
        ),
        note="fused: measured by the live node, including computation. All others were run on the "
        "recording: time waiting for samples, without computation.",
    )


def source_table(name: str, estimates: EstimateSeries) -> Table:
    """Share of the time in which each degree of freedom came from each source."""
    rows = []
    for index, dof in enumerate(estimates.names):
        states = estimates.source[:, index]
        shares = [100.0 * float(np.mean(states == source)) for source in SOURCE_NAMES]
        rows.append(number_row(readable(dof), shares, 0))
    whole = [100.0 * float(np.mean(estimates.source == source)) for source in SOURCE_NAMES]
    rows.append(number_row("all", whole, 1, is_summary=True))
    return Table(
        caption=f"Source of each degree of freedom: {method_label(name)} [% of its instants]",
        head="degree of freedom",
        columns=tuple(SOURCE_NAMES.values()),
        rows=tuple(rows),
    )


def _difference_table(view: ViewAgreement) -> Table:
    angles = [name.removeprefix(f"{SIDES[0]}_") for name in ANGLES[: len(ANGLES) // len(SIDES)]]
    return Table(
        caption=f"RMS difference of the angles, {view.first} – {view.second} [deg]",
        head="angle",
        columns=tuple(f"{side} limb" for side in SIDES),
        rows=tuple(
            number_row(
                readable(angle), [view.angle_difference_deg[f"{side}_{angle}"] for side in SIDES], 1
            )
            for angle in angles
        ),
    )


def _by_part(
    caption: str,
    head: str,
    parts: tuple[str, ...],
    values: Mapping[str, Mapping[str, float]],
    digits: int,
) -> Table:
    rows = [
        number_row(readable(part), [each[part] for each in values.values()], digits, smallest)
        for part in parts
    ]
    means = [mean_known(list(each.values())) for each in values.values()]
    rows.append(number_row("mean", means, digits, smallest, is_summary=True))
    return Table(
        caption=caption,
        head=head,
        columns=tuple(method_label(name) for name in values),
        rows=tuple(rows),
        note="Smallest in bold.",
    )
