"""Biomechanical tables: range of motion, peaks, symmetry, cycles."""

from collections.abc import Mapping
from dataclasses import astuple

from pose_core.api import ANGLES
from pose_core.joints import SIDES
from pose_evaluation.gait_cycles import CycleCurve
from pose_evaluation.range_of_motion import AngleRange, symmetry_index_percent
from pose_evaluation.table import UNKNOWN, Row, Table, number, number_row, text_row
from pose_evaluation.tables import method_label, readable
from pose_view.report.tables.by_part import part_table

ONE_SIDE = tuple(
    name.removeprefix(f"{SIDES[0]}_") for name in ANGLES if name.startswith(f"{SIDES[0]}_")
)


def range_table(ranges: Mapping[str, Mapping[str, AngleRange]]) -> Table:
    """Range of motion of every angle by method."""
    return part_table(
        "Range of motion: highest − lowest angle [deg]",
        "angle",
        {name: {angle: each[angle].range_deg for angle in ANGLES} for name, each in ranges.items()},
        note="Angles after a zero-phase low-pass filter (6 Hz); flexion of hip and shoulder "
        "without what is more than 60° sideways, where it is undefined.",
        digits=1,
    )


def peak_table(method: str, ranges: Mapping[str, AngleRange]) -> Table:
    """Extremes of every angle with their times."""
    return Table(
        caption=f"Peak angles: {method_label(method)}",
        head="angle",
        columns=("lowest [deg]", "at [s]", "highest [deg]", "at [s]", "range [deg]"),
        rows=[
            number_row(readable(angle), [*astuple(each), each.range_deg], 1)
            for angle, each in ranges.items()
        ],
    )


def symmetry_table(method: str, ranges: Mapping[str, AngleRange]) -> Table:
    """Range and peak of left and right, with the symmetry index."""
    rows = []
    for angle in ONE_SIDE:
        sides = [ranges[f"{side}_{angle}"] for side in SIDES]
        cells = []
        for pair in ([s.range_deg for s in sides], [s.highest_deg for s in sides]):
            cells += [number(value, 1) for value in pair]
            cells.append(number(symmetry_index_percent(*pair), 0, sign=True))
        rows.append(text_row(readable(angle), *cells))
    return Table(
        caption=f"Left and right: {method_label(method)}",
        head="angle",
        columns=(
            *("range, left [deg]", "range, right [deg]", "index [%]"),
            *("peak, left [deg]", "peak, right [deg]", "index [%]"),
        ),
        rows=rows,
        note="Symmetry index: (left − right) / mean of both; 0 is symmetric, positive says that "
        "the left is larger. – where both are below 5°.",
    )


def cycle_table(
    side: str, curves: Mapping[str, Mapping[str, CycleCurve]], methods: tuple[str, ...]
) -> Table:
    """Range of motion of one side's cycles, by method."""
    rows: list[Row] = []
    for angle in (name for name in ANGLES if name.startswith(side)):
        found = [curves.get(method, {}).get(angle) for method in methods]
        if any(found):
            rows.append(text_row(readable(angle), *map(_mean_and_sd, found)))
    return Table(
        caption=f"Range of motion of a cycle, {side} side: mean ± SD between cycles [deg]",
        head="angle",
        columns=[method_label(method) for method in methods],
        rows=rows,
    )


def _mean_and_sd(curve: CycleCurve | None) -> str:
    if curve is None:
        return UNKNOWN
    mean, sd = number(curve.range_mean_deg, 1), number(curve.range_sd_deg, 1)
    return f"{mean} ±\N{NO-BREAK SPACE}{sd}"
