"""How good one virtual Kinect is, in the figures that are published of real ones."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pose_common.joints import JOINT_INDEX, SIDES
from pose_sim.angles import measured_angles
from pose_sim.choreography import STILL
from pose_sim.motion import Motion
from pose_sim.rotations import FloatArray
from pose_sim.scene import SENSORS
from pose_sim.session import Session
from pose_sim.virtual_kinect import KinectFrames

LEG_ANGLES = tuple(
    f"{side}_{angle}"
    for angle in ("hip_flexion", "hip_abduction", "knee_flexion")
    for side in SIDES
)
WARM_UP_END = 16.0  # [s] figures are taken of the choreography itself
LARGEST_SHIFT = 0.2  # [s] searched for the one global time shift
POLE = np.radians(60.0)  # beyond this abduction flexion says nothing
BONES = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in SIDES
    for a, b in (("hip", "knee"), ("knee", "foot"), ("shoulder", "elbow"), ("elbow", "hand"))
)


@dataclass(frozen=True, kw_only=True)
class AngleError:
    """One angle of one sensor against the truth."""

    rmse_deg: float
    r: float


def angle_errors(
    motion: Motion, frames: KinectFrames, names: Sequence[str]
) -> dict[str, AngleError]:
    """Root mean square error and Pearson's r of measured angles, after one global time shift.

    Args:
        motion: The truth.
        frames: What the sensor delivered.
        names: Angles of :func:`pose_sim.angles.measured_angles`.
    """
    measured = measured_angles(frames.positions)
    shifts = np.arange(-LARGEST_SHIFT, LARGEST_SHIFT, 0.005)
    used = frames.capture_s > WARM_UP_END
    used &= frames.capture_s < motion.times[-1] - LARGEST_SHIFT
    times = frames.capture_s[used]
    truths = [measured_angles(motion.joints_at(times + shift)) for shift in shifts]

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
    """How two sensors' skeletons of one motion differ, without any truth."""

    distance_cm: float  # mean distance of a joint between the views, after the best rigid fit
    bone_variation_percent: float  # standard deviation of a limb's length, of its mean
    knee_difference_deg: float  # RMS difference of the knee angle between the views


def two_views(session: Session, start: float, end: float) -> TwoViews:
    """Compare both sensors between two times [s] of a session."""
    left, right = (session.kinects[name] for name in SENSORS)
    chosen = (left.capture_s >= start) & (left.capture_s <= end)
    times = left.capture_s[chosen]
    first = left.positions[chosen]
    second = _interpolated(right, times)
    both = np.isfinite(first).all(axis=2) & np.isfinite(second).all(axis=2)
    gap = first[both] - _rigid_fit(second[both], first[both])(second[both])
    knees = [f"{side}_knee_flexion" for side in SIDES]
    a, b = measured_angles(first), measured_angles(second)
    differences = np.concatenate([a[knee] - b[knee] for knee in knees])
    variations = [
        np.nanstd(length) / np.nanmean(length)
        for view in (first, second)
        for length in (
            np.linalg.norm(view[:, JOINT_INDEX[p]] - view[:, JOINT_INDEX[q]], axis=1)
            for p, q in BONES
        )
    ]
    return TwoViews(
        distance_cm=100.0 * float(np.linalg.norm(gap, axis=1).mean()),
        bone_variation_percent=100.0 * float(np.mean(variations)),
        knee_difference_deg=float(np.degrees(np.sqrt(np.nanmean(differences**2)))),
    )


def still_interval() -> tuple[float, float]:
    """When the subject stands still [s]."""
    return 0.0, STILL


def _interpolated(frames: KinectFrames, times: FloatArray) -> FloatArray:
    after = np.clip(np.searchsorted(frames.capture_s, times), 1, len(frames.capture_s) - 1)
    t0, t1 = frames.capture_s[after - 1], frames.capture_s[after]
    share = np.clip((times - t0) / (t1 - t0), 0.0, 1.0)[:, None, None]
    between: FloatArray = (1.0 - share) * frames.positions[after - 1]
    return between + share * frames.positions[after]


def _rigid_fit(source: FloatArray, target: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """The rigid motion that brings source points closest to target points: Umeyama (1991)."""
    middle, goal = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((target - goal).T @ (source - middle))
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return lambda points: (points - middle) @ turn.T + goal
