"""Comparison of a virtual Kinect's accuracy with published figures of real ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.api import best_rigid_transform, joint_angles, transformed
from pose_core.joints import JOINT_INDEX, LIMB_ENDS, SIDES
from pose_sim.choreography import STILL
from pose_sim.motion import Motion
from pose_sim.rotations import FloatArray
from pose_sim.scene import SENSORS, SceneParameters
from pose_sim.session import Session, make_session, settings_of
from pose_sim.virtual_kinect import KinectFrames

LEG_ANGLES = tuple(
    f"{side}_{angle}"
    for angle in ("hip_flexion", "hip_abduction", "knee_flexion")
    for side in SIDES
)
WARM_UP_END = 16.0  # [s] figures are computed after the warm-up
DURATION = 60.0  # [s] of each session
LARGEST_SHIFT = 0.2  # [s] searched for the one global time shift
POLE = np.radians(60.0)  # abduction from which on flexion is undefined


KNEES = tuple(f"{side}_knee_flexion" for side in SIDES)
SHOULDERS = tuple(f"{side}_shoulder_abduction" for side in SIDES)
ELBOWS = tuple(f"{side}_elbow_flexion" for side in SIDES)
FACING, ASIDE = SENSORS

ANGLE_FIGURES = (
    ("side leg lift, jump: 6 leg angles", "leg_lift_jump", LEG_ANGLES, FACING, "13.7°, r 0.78 [1]"),
    ("the same, sensor aside", "leg_lift_jump", LEG_ANGLES, ASIDE, "15.6°, r 0.76 [1]"),
    ("side leg lift, march: the same", "leg_lift_march", LEG_ANGLES, FACING, "33.0°, r 0.42 [1]"),
    ("the same, sensor aside", "leg_lift_march", LEG_ANGLES, ASIDE, "37.4°, r 0.45 [1]"),
    ("squat: knee", "squats", KNEES, FACING, "6.2° [2]"),
    ("march: knee", "leg_lift_march", KNEES, FACING, "hurdle step 11.5°, inline lunge 16.6° [2]"),
    ("arm raises: shoulder abduction", "arm_raises", SHOULDERS, FACING, "abduction 10° [2]"),
    ("arm raises: elbow", "arm_raises", ELBOWS, FACING, "4° to 14° [2]"),
)  # fmt: skip
"""Quantity, choreography, angles, sensor, and the published figure."""

VIEW_FIGURES = (
    ("two views 45° apart, standing", 45.0, (0.0, STILL), "2.8 cm, 0.6 %, 3.8° [3]"),
    ("two views 45° apart, marching", 45.0, (WARM_UP_END, np.inf), "3.7 cm, 7.1 %, 15.1° [3]"),
    ("two views 90° apart, marching", 90.0, (WARM_UP_END, np.inf), "6.6 cm, 7.7 %, 18.9° [3]"),
)  # fmt: skip
"""Quantity, angle between the views [deg], interval [s], and the figures of recordings: joint
distance after the best rigid fit, variation of limb lengths, difference of the knee angles."""


@dataclass(frozen=True, kw_only=True)
class AngleError:
    """Error of one angle of one sensor."""

    rmse_deg: float
    r: float


def angle_errors(
    motion: Motion, frames: KinectFrames, names: Sequence[str]
) -> dict[str, AngleError]:
    """Root mean square error and Pearson's r of measured angles, after one global time shift.

    Args:
        motion: The true motion.
        frames: The sensor's frames.
        names: Angles of :func:`pose_core.api.joint_angles`.
    """
    measured = joint_angles(frames.positions)
    shifts = np.arange(-LARGEST_SHIFT, LARGEST_SHIFT, 0.005)
    used = frames.capture_s > WARM_UP_END
    used &= frames.capture_s < motion.times[-1] - LARGEST_SHIFT
    times = frames.capture_s[used]
    truths = [joint_angles(motion.joints_at(times + shift)) for shift in shifts]

    def errors(
        truth: dict[str, FloatArray], name: str
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        error = (measured[name][used] - truth[name] + np.pi) % (2.0 * np.pi) - np.pi
        kept = np.isfinite(error)
        if name.endswith(("shoulder_flexion", "hip_flexion")):
            kept &= np.abs(truth[name.replace("flexion", "abduction")]) < POLE
        return error[kept], measured[name][used][kept], truth[name][kept]

    def total(truth: dict[str, FloatArray]) -> float:
        return sum(float(np.mean(errors(truth, name)[0] ** 2)) for name in names)

    best = min(truths, key=total)
    result = {}
    for name in names:
        error, seen, true = errors(best, name)
        result[name] = AngleError(
            rmse_deg=float(np.degrees(np.sqrt(np.mean(error**2)))),
            r=float(np.corrcoef(seen, true)[0, 1]),
        )
    return result


def mean_error(
    session: Session, names: Sequence[str], sensors: Sequence[str] = SENSORS
) -> AngleError:
    """The mean of :func:`angle_errors` over angles and sensors."""
    errors = [
        error
        for sensor in sensors
        for error in angle_errors(session.motion, session.kinects[sensor], names).values()
    ]
    return AngleError(
        rmse_deg=float(np.mean([error.rmse_deg for error in errors])),
        r=float(np.mean([error.r for error in errors])),
    )


@dataclass(frozen=True, kw_only=True)
class TwoViews:
    """Differences between two sensors' skeletons of one motion, without ground truth."""

    distance_cm: float  # mean distance of a joint between the views, after the best rigid fit
    bone_variation_percent: float  # standard deviation of a limb's length, relative to its mean
    knee_difference_deg: float  # RMS difference of the knee angle between the views


def two_views(session: Session, start: float, end: float) -> TwoViews:
    """Compare both sensors between two times [s] of a session."""
    left, right = (session.kinects[name] for name in SENSORS)
    chosen = (left.capture_s >= start) & (left.capture_s <= end)
    times = left.capture_s[chosen]
    first = left.positions[chosen]
    second = _interpolated(right, times)
    both = np.isfinite(first).all(axis=2) & np.isfinite(second).all(axis=2)
    gap = first[both] - transformed(best_rigid_transform(second[both], first[both]), second[both])
    a, b = joint_angles(first), joint_angles(second)
    differences = np.concatenate([a[knee] - b[knee] for knee in KNEES])
    variations = [
        np.nanstd(length) / np.nanmean(length)
        for view in (first, second)
        for length in (
            np.linalg.norm(view[:, JOINT_INDEX[p]] - view[:, JOINT_INDEX[q]], axis=1)
            for p, q in LIMB_ENDS.values()
        )
    ]
    return TwoViews(
        distance_cm=100.0 * float(np.linalg.norm(gap, axis=1).mean()),
        bone_variation_percent=100.0 * float(np.mean(variations)),
        knee_difference_deg=float(np.degrees(np.sqrt(np.nanmean(differences**2)))),
    )


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the comparison."""

    quantity: str
    published: str
    simulated: str


def compare(preset: str, seeds: Sequence[int] = (1, 2)) -> list[Row]:
    """Published figures of a Kinect and those of the virtual ones.

    Args:
        preset: One of :data:`pose_sim.session.NOISE_PRESETS`.
        seeds: Sessions over which the figures are averaged.
    """
    made: dict[tuple[str, float], list[Session]] = {}

    def sessions(choreography: str, aside: float) -> list[Session]:
        settings = settings_of(preset, {"scene": {"aside": aside}})
        key = (choreography, aside)
        if key not in made:
            made[key] = [make_session(choreography, DURATION, seed, settings) for seed in seeds]
        return made[key]

    rows = []
    for quantity, choreography, names, sensor, published in ANGLE_FIGURES:
        performed = sessions(choreography, SceneParameters().aside)
        rows.append(_angles_row(quantity, published, performed, names, sensor))
    for quantity, aside, (start, end), published in VIEW_FIGURES:
        performed = sessions("leg_lift_march", aside)
        rows.append(_views_row(quantity, published, performed, start, min(end, DURATION - 1.0)))
    return rows


def _angles_row(
    quantity: str, published: str, sessions: Sequence[Session], names: Sequence[str], sensor: str
) -> Row:
    errors = [mean_error(session, names, [sensor]) for session in sessions]
    rmse = np.mean([error.rmse_deg for error in errors])
    r = np.mean([error.r for error in errors])
    return Row(quantity=quantity, published=published, simulated=f"{rmse:.1f}°, r {r:.2f}")


def _views_row(
    quantity: str, published: str, sessions: Sequence[Session], start: float, end: float
) -> Row:
    views = [two_views(session, start, end) for session in sessions]
    distance = np.mean([view.distance_cm for view in views])
    variation = np.mean([view.bone_variation_percent for view in views])
    knee = np.mean([view.knee_difference_deg for view in views])
    return Row(
        quantity=quantity,
        published=published,
        simulated=f"{distance:.1f} cm, {variation:.1f} %, {knee:.1f}°",
    )


def _interpolated(frames: KinectFrames, times: FloatArray) -> FloatArray:
    after = np.clip(np.searchsorted(frames.capture_s, times), 1, len(frames.capture_s) - 1)
    t0, t1 = frames.capture_s[after - 1], frames.capture_s[after]
    share = np.clip((times - t0) / (t1 - t0), 0.0, 1.0)[:, None, None]
    between: FloatArray = (1.0 - share) * frames.positions[after - 1]
    return between + share * frames.positions[after]
