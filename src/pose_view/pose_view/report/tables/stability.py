"""Tables without a reference: difference of the methods, bones, jerk, latency, sources."""

from collections.abc import Mapping

import numpy as np

from pose_core.api import AngleSeries, EstimateSeries, Source
from pose_core.finite_numbers import mean_known
from pose_evaluation.agreement import MethodStability, angle_differences_deg
from pose_evaluation.table import Table, number_row
from pose_evaluation.tables import method_label, readable
from pose_view.report.tables.by_part import part_table

SOURCES = {
    Source.KINECT: ("Kinect", "#56B4E9"),
    Source.FUSED: ("Kinect and IMU", "#D55E00"),
    Source.IMU: ("IMU", "#117733"),
    Source.PREDICTED: ("predicted", "#bbbbbb"),
}
"""Name and colour of each source."""


def method_table(angles: Mapping[str, AngleSeries]) -> Table:
    """Differences between the methods and the reference."""
    differences = angle_differences_deg(angles)
    rows = {one: [differences.get((one, two), np.nan) for two in angles] for one in angles}
    return Table(
        caption="Difference of the methods: RMS, mean of the angles [deg]",
        head="method",
        columns=[method_label(name) for name in angles],
        rows=[number_row(method_label(name), values, 1) for name, values in rows.items()],
        note="Each pair over its common time and the angles that both have; no lag is removed.",
    )


def bone_table(stability: Mapping[str, MethodStability]) -> Table:
    """Standard deviation of each bone's length."""
    values = {name: each.bone_sd_mm for name, each in stability.items()}
    return _with_mean("Standard deviation of the bones' lengths [mm]", "bone", values, 1)


def jerk_table(stability: Mapping[str, MethodStability]) -> Table:
    """RMS jerk of each joint."""
    values = {name: each.jerk for name, each in stability.items()}
    return _with_mean("RMS jerk of the joints [m/s³], at 30 Hz", "joint", values, 0)


def timing_table(estimates: Mapping[str, EstimateSeries]) -> Table:
    """Latency of each method."""
    latencies_ms = {
        name: (1000.0 * np.percentile(each.latency_s, [50, 99, 100])).tolist()
        for name, each in estimates.items()
    }
    return Table(
        caption="Latency: from the newest sample's capture to the result [ms]",
        head="method",
        columns=("median", "99 %", "longest"),
        rows=[number_row(method_label(name), values, 0) for name, values in latencies_ms.items()],
        note="fused, of a live recording: as measured by the node, including computation. Of a bag "
        "of ./pose fuse, and of all others: time waiting for samples, without computation.",
    )


def source_table(name: str, estimates: EstimateSeries) -> Table:
    """Share of the time in which each degree of freedom came from each source."""
    is_from = estimates.source == np.array(list(SOURCES))[:, None, None]
    shares = (100.0 * is_from.mean(axis=1).T).tolist()
    whole = (100.0 * is_from.mean(axis=(1, 2))).tolist()
    rows = [number_row(readable(d), s, 0) for d, s in zip(estimates.names, shares, strict=True)]
    rows.append(number_row("all", whole, 1, is_summary=True))
    return Table(
        caption=f"Source of each degree of freedom: {method_label(name)} [% of its instants]",
        head="degree of freedom",
        columns=tuple(name for name, _ in SOURCES.values()),
        rows=rows,
    )


def _with_mean(
    caption: str, head: str, values: Mapping[str, Mapping[str, float]], digits: int
) -> Table:
    means = [mean_known(list(each.values())) for each in values.values()]
    mean = number_row("mean", means, digits, min, is_summary=True)
    note = "Smallest in bold."
    return part_table(caption, head, values, [mean], note, digits=digits, best=min)
