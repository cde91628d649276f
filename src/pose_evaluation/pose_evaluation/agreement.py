"""Figures without a reference: agreement of two views, constancy of the bones."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from pose_core.api import (
    ANGLES,
    AngleSeries,
    FloatArray,
    SkeletonSeries,
    joint_angles,
    transformed,
    wrapped,
)
from pose_core.finite_numbers import mean_known
from pose_evaluation.methods import aligned_frames
from pose_evaluation.scores import known_joints, rigidly_aligned
from pose_evaluation.stability import Stability, bone_length_cv_percent, bone_length_sd_mm, rms_jerk

COMPARING_RATE = 30.0  # [Hz]
GAP_S = 0.2  # [s] six frames at 30 Hz: longer intervals count as gaps


@dataclass(frozen=True, kw_only=True)
class ViewAgreement:
    """Differences between two sensors' measurements of the same joints at the same instants."""

    first: str
    second: str
    frames: int  # [-] instants at which both tracked a person
    as_logged_cm: float  # [cm] mean distance without extrinsics, as if both frames were one
    calibrated_cm: float  # [cm] in map, by the extrinsics; NaN without them
    best_rigid_cm: float  # [cm] after the best rigid fit to the same data: the lower bound
    angle_difference_deg: Mapping[str, float]  # [deg] RMS by angle


@dataclass(frozen=True, kw_only=True)
class MethodStability(Stability):
    """Constancy of a method's bone lengths and smoothness of its joints."""

    frames: int  # [-]
    gaps: int  # [-] intervals of more than 0.2 s
    longest_gap_s: float  # [s]
    bone_cv_percent: Mapping[str, float]  # [%] by bone

    @property
    def mean_bone_cv_percent(self) -> float:
        """Mean over the bones [%]."""
        return mean_known(list(self.bone_cv_percent.values()))


def measure_agreement(
    methods: Mapping[str, SkeletonSeries], T_map_sensor: Mapping[str, FloatArray]
) -> tuple[ViewAgreement, ...]:
    """Compare every pair of sensors.

    Args:
        methods: Joints by method, as :func:`pose_evaluation.methods.methods_of_bag` gives them;
            the sensors are those that are neither ``mean`` nor ``fused``.
        T_map_sensor: Each sensor's (4, 4) extrinsics.
    """
    sensors = {name: series for name, series in methods.items() if name not in {"mean", "fused"}}
    return tuple(
        view_agreement(first, second, sensors, T_map_sensor)
        for first, second in combinations(sensors, 2)
    )


def view_agreement(
    first: str,
    second: str,
    sensors: Mapping[str, SkeletonSeries],
    T_map_sensor: Mapping[str, FloatArray],
) -> ViewAgreement:
    """Compare two sensors' views, aligned in time by li2020 (2)."""
    pair = {name: sensors[name] for name in (first, second)}
    both = [frame for frame in aligned_frames(pair) if len(frame.samples) == 2]
    one, two = (
        np.array([frame.samples[name].positions for frame in both]).reshape(-1, 15, 3)
        for name in (first, second)
    )
    calibrated = np.nan
    if first in T_map_sensor and second in T_map_sensor:
        calibrated = _mean_distance_cm(
            transformed(T_map_sensor[first], one), transformed(T_map_sensor[second], two)
        )
    shared = int((known_joints(one) & known_joints(two)).sum())
    fit = rigidly_aligned(two, one) if shared >= 3 else two
    return ViewAgreement(
        first=first,
        second=second,
        frames=len(both),
        as_logged_cm=_mean_distance_cm(one, two),
        calibrated_cm=calibrated,
        best_rigid_cm=_mean_distance_cm(one, fit),
        angle_difference_deg=rms_differences_deg(joint_angles(one), joint_angles(two)),
    )


def rms_differences_deg(
    one: Mapping[str, FloatArray], two: Mapping[str, FloatArray]
) -> dict[str, float]:
    """RMS difference of each angle [deg] between two series (n,) [rad]; NaN where unknown."""
    return {
        name: float(np.degrees(np.sqrt(mean_known(wrapped(two[name] - one[name]) ** 2))))
        for name in ANGLES
    }


def angle_differences_deg(angles: Mapping[str, AngleSeries]) -> dict[tuple[str, str], float]:
    """Differences between methods: RMS difference [deg], mean over the angles.

    Args:
        angles: Each method's angles by its name, on one clock.

    Returns:
        By pair of names, in both orders, over their common time; NaN without common time.
    """
    begin_ns = min(int(series.stamps_ns[0]) for series in angles.values())
    end_ns = max(int(series.stamps_ns[-1]) for series in angles.values())
    grid = np.arange(begin_ns, end_ns + 1, round(1e9 / COMPARING_RATE), dtype=np.int64)
    on_grid = {name: series.at(grid) for name, series in angles.items()}
    differences = {}
    for first, second in combinations(angles, 2):
        of_angles = rms_differences_deg(on_grid[first], on_grid[second])
        differences[first, second] = differences[second, first] = mean_known([*of_angles.values()])
    return differences


def measure_stability(series: SkeletonSeries) -> MethodStability:
    """Compute the figures of one method."""
    steps_s = np.diff(series.stamps_ns) * 1e-9
    gaps = steps_s[steps_s > GAP_S]
    return MethodStability(
        frames=len(series),
        gaps=len(gaps),
        longest_gap_s=float(gaps.max()) if len(gaps) else 0.0,
        bone_cv_percent=bone_length_cv_percent(series.positions),
        bone_sd_mm=bone_length_sd_mm(series.positions),
        jerk=rms_jerk(series),
    )


def _mean_distance_cm(one: FloatArray, two: FloatArray) -> float:
    return 100.0 * mean_known(np.linalg.norm(one - two, axis=2))
