"""Tables without a reference: difference of the methods, bones, jerk, latency, sources."""

from collections.abc import Mapping

import numpy as np

from pose_core.api import AngleSeries, EstimateSeries, Source
from pose_core.finite_numbers import mean_known
from pose_core.joints import JOINTS
from pose_evaluation.agreement import MethodStability, angle_differences_deg
from pose_evaluation.stability import BONES
from pose_evaluation.table import (
    Table,
    number_row,
    smallest,
)
from pose_evaluation.tables import method_label, readable

SOURCE_NAMES = {
    Source.KINECT: "Kinect",
    Source.FUSED: "Kinect and IMU",
    Source.IMU: "IMU",
    Source.PREDICTED: "predicted",
}


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


def bone_table(stability: Mapping[str, MethodStability]) -> Table:
    """Standard deviation of each bone's length."""
    return _by_part(
        "Standard deviation of the bones' lengths [mm]",
        "bone",
        tuple(BONES),
        {name: each.bone_sd_mm for name, each in stability.items()},
        digits=1,
    )


def jerk_table(stability: Mapping[str, MethodStability]) -> Table:
    """RMS jerk of each joint."""
    return _by_part(
        "RMS jerk of the joints [m/s³], at 30 Hz",
        "joint",
        JOINTS,
        {name: each.jerk for name, each in stability.items()},
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
