"""Accuracy on captured people before simulated sensors: sessions, methods, scores.

Each method's one time shift against the truth is removed, as everywhere (docs/conventions.md); the
yardstick is ``joint_kf`` on the same samples. The first seconds, in which bodies are measured, are
not judged; those in which IMUs are aligned are.
"""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_bench.scoring import HIP_AND_KNEE
from pose_core.api import FusionParameters, SkeletonSeries, extrinsics_from_map
from pose_core.errors import InputError
from pose_core.joints import JOINTS, TrackingState
from pose_evaluation.offline import MethodSetup, run_methods
from pose_evaluation.scores import MethodScores, mean_known, score_method
from pose_sim.captured.clips import RATE, bundled_clips
from pose_sim.captured.session import CapturedSession, CapturedSpec, make_captured_session, stamp_of
from pose_sim.captured.trackers import TRACKERS, TUNED_ON

JUDGED_FROM_S = 3.0  # [s]
GROUPED = 16  # clips of a session, about
METHODS = (
    MethodSetup(name="left", estimator="left"),
    MethodSetup(name="mean", estimator="mean"),
    MethodSetup(name="joint_kf", estimator="joint_kf"),
    MethodSetup(name="li2020", estimator="li2020"),
    MethodSetup(name="default", estimator="default"),
    MethodSetup(name="default+imus", estimator="default", use_imus=True),
    MethodSetup(name="smoothed", estimator="smoothed"),
    MethodSetup(name="smoothed+imus", estimator="smoothed", use_imus=True),
)
BASELINE = "joint_kf"


@dataclass(frozen=True, kw_only=True)
class CapturedScore:
    """One method on one session; ratios are to the baseline's."""

    session: str
    method: str
    rmse_deg: float
    hip_knee_deg: float
    r: float
    mpjpe_mm: float
    lag_ms: float
    jerk: float
    rmse_ratio: float
    mpjpe_ratio: float


def captured_specs(motion: Path | None, *, judged: bool, seed: int) -> list[CapturedSpec]:
    """Sessions over a folder of clips: by its ``index.csv`` those of one person or action together.

    Args:
        motion: The folder; None: the clips that come with ``pose_sim``.
        judged: Whether to use the trackers that tuning has not seen.
        seed: Of everything random.

    Raises:
        InputError: If the folder holds no clips.
    """
    clips = bundled_clips() if motion is None else sorted(motion.glob("*.npz"))
    if not clips:
        raise InputError(f"{motion} holds no clips: expected .npz files, see pose_sim")
    groups = _groups(motion, clips)
    unseen = tuple(name for name in TRACKERS if name not in TUNED_ON)
    trackers = (*unseen, "mixed", "late") if judged else TUNED_ON
    rng = np.random.default_rng(seed)
    specs: list[CapturedSpec] = []
    for name, files in groups:
        order = rng.permutation(len(files))
        index = len(specs)
        pair = trackers[index % len(trackers)], trackers[(3 * index + 1) % len(trackers)]
        specs.append(
            CapturedSpec(
                name=f"{name} {pair[0]}/{pair[1]}",
                clips=tuple(files[i] for i in order),
                trackers=pair,
                spins=index % 2 == 1,
                seed=seed + index,
            )
        )
    return specs


def _groups(motion: Path | None, clips: Sequence[Path]) -> list[tuple[str, list[Path]]]:
    """Clips of one person (as far as the index tells) together, in parts of a session's length."""
    person: dict[str, str] = {}
    if motion is not None and (motion / "index.csv").exists():
        with (motion / "index.csv").open() as file:
            person = {row["file"]: row["subject"] for row in csv.DictReader(file)}
    groups: dict[str, list[Path]] = {}
    for clip in clips:
        groups.setdefault(person.get(clip.name, "clips"), []).append(clip)
    parts = []
    for name, files in sorted(groups.items()):
        count = max(1, round(len(files) / GROUPED)) if len(files) > 3 else 1
        parts += [(f"{name} {k + 1}", files[k::count]) for k in range(count)]
    return parts


def score_session(session: CapturedSession, methods: Sequence[MethodSetup]) -> list[CapturedScore]:
    """Run methods over a session's samples, with the true extrinsics, and judge them."""
    extrinsics = extrinsics_from_map(session.T_map_sensor)
    sensors = FusionParameters().sensors
    has_imus = any(method.use_imus for method in methods)
    runs = run_methods(session.samples(imus=has_imus), methods, sensors, extrinsics)
    truth = truth_of(session)
    scores = {name: score_method(name, run.series, truth) for name, run in runs.items()}
    baseline = scores[BASELINE]
    return [_score(session.spec.name, name, each, baseline) for name, each in scores.items()]


def truth_of(session: CapturedSession) -> SkeletonSeries:
    """The captured joints, from the first judged instant on."""
    first = round(JUDGED_FROM_S * RATE)
    positions = session.clip.positions
    return SkeletonSeries(
        stamps_ns=np.array([stamp_of(i / RATE) for i in range(first, len(positions))]),
        positions=positions[first:],
        tracking_state=np.full(
            (len(positions) - first, len(JOINTS)), int(TrackingState.TRACKED), np.uint8
        ),
    )


def _score(
    session: str, method: str, scores: MethodScores, baseline: MethodScores
) -> CapturedScore:
    rmse = {angle: each.rmse_deg for angle, each in scores.angles.items()}
    return CapturedScore(
        session=session,
        method=method,
        rmse_deg=scores.mean_rmse_deg,
        hip_knee_deg=mean_known([rmse[angle] for angle in HIP_AND_KNEE]),
        r=scores.mean_r,
        mpjpe_mm=scores.mpjpe_mm,
        lag_ms=1000.0 * scores.shift_s,
        jerk=scores.mean_jerk,
        rmse_ratio=scores.mean_rmse_deg / baseline.mean_rmse_deg,
        mpjpe_ratio=scores.mpjpe_mm / baseline.mpjpe_mm,
    )


def run_suite(
    specs: Iterable[CapturedSpec], methods: Sequence[MethodSetup] = METHODS
) -> Iterable[list[CapturedScore]]:
    """Scores of one session after the other."""
    for spec in specs:
        yield score_session(make_captured_session(spec), methods)
