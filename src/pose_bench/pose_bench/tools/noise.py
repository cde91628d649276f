"""``./pose bench noise``: errors of the virtual Kinects beside those published of real Kinects."""

import argparse
from collections.abc import Sequence
from functools import cache

import numpy as np
from rich.console import Console

from pose_bench.options import add_list
from pose_bench.sessions import EVALUATED_FROM_S, BenchSession, SessionSpec, bench_session
from pose_bench.tools.showing import publish
from pose_core.api import SkeletonSeries, series_from_samples
from pose_core.finite_numbers import mean_known
from pose_core.joints import LIMB_ENDS, SIDES
from pose_core.stamps import NS_PER_S
from pose_evaluation.agreement import view_agreement
from pose_evaluation.scores import HIPS_AND_KNEES as LEGS, score_method
from pose_evaluation.stability import bone_length_cv_percent
from pose_evaluation.table import Table, text_row
from pose_io.references.reference import reference_of_skeleton
from pose_sim.captured.session import START_NS
from pose_sim.choreography import STILL
from pose_sim.scene import SENSORS, SceneParameters
from pose_sim.session import NOISE_PRESETS

SUMMARY = "errors of the virtual Kinects beside those published of real Kinects"
TITLE = "Virtual and real Kinects"
DURATION_S = 60.0  # [s] of each session
KNEES = tuple(f"{side}_knee_flexion" for side in SIDES)
SHOULDERS = tuple(f"{side}_shoulder_abduction" for side in SIDES)
ELBOWS = tuple(f"{side}_elbow_flexion" for side in SIDES)
FACING, ASIDE = SENSORS
MARCHING = (EVALUATED_FROM_S, DURATION_S - 1.0)  # [s]

ANGLE_FIGURES = (
    ("side leg lift, jump: 6 leg angles", "leg_lift_jump", LEGS, FACING, "13.7°, r 0.78 [1]"),
    ("the same, sensor aside", "leg_lift_jump", LEGS, ASIDE, "15.6°, r 0.76 [1]"),
    ("side leg lift, march: the same", "leg_lift_march", LEGS, FACING, "33.0°, r 0.42 [1]"),
    ("the same, sensor aside", "leg_lift_march", LEGS, ASIDE, "37.4°, r 0.45 [1]"),
    ("squat: knee", "squats", KNEES, FACING, "6.2° [2]"),
    ("march: knee", "leg_lift_march", KNEES, FACING, "hurdle step 11.5°, inline lunge 16.6° [2]"),
    ("arm raises: shoulder abduction", "arm_raises", SHOULDERS, FACING, "abduction 10° [2]"),
    ("arm raises: elbow", "arm_raises", ELBOWS, FACING, "4° to 14° [2]"),
)  # fmt: skip
"""Quantity, choreography, angles, sensor, and the published figure."""

VIEW_FIGURES = (
    ("two views 45° apart, standing", 45.0, (0.0, STILL), "2.8 cm, 0.6 %, 3.8° [3]"),
    ("two views 45° apart, marching", 45.0, MARCHING, "3.7 cm, 7.1 %, 15.1° [3]"),
    ("two views 90° apart, marching", 90.0, MARCHING, "6.6 cm, 7.7 %, 18.9° [3]"),
)  # fmt: skip
"""Quantity, angle between the views [deg], interval [s], and the figures of recordings: joint
distance after the best rigid fit, variation of limb lengths, difference of the knee angles."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_list(parser, "--noise", ["typical", "hard"], "presets to measure", choices=NOISE_PRESETS)
    add_list(parser, "--seeds", [1, 2, 3], "sessions")


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    presets, seeds = arguments.noise, arguments.seeds
    rows = []
    with Console(stderr=True).status("measuring"):
        for quantity, choreography, names, sensor, published in ANGLE_FIGURES:
            sessions = _sessions(choreography, SceneParameters().aside, presets, seeds)
            found = [[angle_error(each, sensor, names) for each in of] for of in sessions]
            means = (_mean("{:.1f}°, r {:.2f}", of) for of in found)
            rows.append(text_row(quantity, published, *means))
        for quantity, aside, (begin_s, end_s), published in VIEW_FIGURES:
            sessions = _sessions("leg_lift_march", aside, presets, seeds)
            views = [[two_views(each, begin_s, end_s) for each in of] for of in sessions]
            means = (_mean("{:.1f} cm, {:.1f} %, {:.1f}°", of) for of in views)
            rows.append(text_row(quantity, published, *means))
    table = Table(caption=TITLE, head="quantity", columns=["published", *presets], rows=rows)
    publish([table], TITLE, arguments.output, "noise.md")
    return 0


def angle_error(session: BenchSession, sensor: str, names: Sequence[str]) -> tuple[float, float]:
    """RMSE [deg] and Pearson's r of a sensor's angles, means over the angles."""
    truth = reference_of_skeleton("the truth", session.evaluated_truth)
    angles = score_method(sensor, _view(session, sensor), truth).angles
    scores = [angles[name] for name in names]
    return mean_known([each.rmse_deg for each in scores]), mean_known([each.r for each in scores])


def two_views(session: BenchSession, begin_s: float, end_s: float) -> tuple[float, float, float]:
    """Differences of the two sensors' views between two times [s] of a session.

    Returns:
        Mean distance of a joint after the best rigid fit [cm], coefficient of variation of a limb's
        length [%], RMS difference of the knees' angles [deg].
    """
    begin_ns, end_ns = (START_NS + round(at_s * NS_PER_S) for at_s in (begin_s, end_s))
    views = {sensor: _view(session, sensor).between(begin_ns, end_ns) for sensor in SENSORS}
    agreement = view_agreement(*SENSORS, views, {})
    lengths = [bone_length_cv_percent(view.positions) for view in views.values()]
    return (
        agreement.best_rigid_cm,
        mean_known([each[limb] for each in lengths for limb in LIMB_ENDS]),
        mean_known([agreement.angle_difference_deg[knee] for knee in KNEES]),
    )


def _sessions(
    choreography: str, aside: float, presets: Sequence[str], seeds: Sequence[int]
) -> list[list[BenchSession]]:
    return [[_session(choreography, aside, preset, seed) for seed in seeds] for preset in presets]


@cache
def _session(choreography: str, aside: float, preset: str, seed: int) -> BenchSession:
    spec = SessionSpec(choreography=choreography, level=preset, seed=seed, duration_s=DURATION_S)
    return bench_session(spec, imus=False, overrides={"scene": {"aside": aside}})


def _view(session: BenchSession, sensor: str) -> SkeletonSeries:
    return series_from_samples(each for each in session.skeletons if each.sensor == sensor)


def _mean(text: str, found: Sequence[Sequence[float]]) -> str:
    return text.format(*np.mean(found, axis=0))
