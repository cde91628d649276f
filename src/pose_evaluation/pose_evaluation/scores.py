"""Errors of each method against a reference: angles, joint positions, stability.

Every method is evaluated by its joint positions, with the same code: angles of
``joint_angles``, after one time shift for the whole recording; Pearson's r, RMSE and bias modulo
360°; mean joint position error after one rigid alignment of the whole recording.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.api import (
    ANGLES,
    FloatArray,
    SkeletonSeries,
    anatomical,
    angle_series,
    best_rigid_transform,
    joint_angles,
    transformed,
    without_sideways_flexion,
    wrapped,
)
from pose_core.errors import InputError
from pose_core.finite_numbers import mean_known
from pose_core.joints import JOINT_INDEX
from pose_evaluation.stability import Stability, bone_length_sd_mm, rms_jerk
from pose_evaluation.time_shift import STILL, estimate_angle_shift
from pose_io.arrays import BoolArray
from pose_io.references.reference import Reference

HIPS_AND_KNEES = tuple(name for name in ANGLES if "hip" in name or "knee" in name)
"""The six angles of li2020's tables."""
MIN_OVERLAP_S = 1.0  # [s] smallest common time for an evaluation


@dataclass(frozen=True, kw_only=True)
class AngleScore:
    """Agreement of one angle with the reference; NaN where it is undefined."""

    r: float  # [-] Pearson's correlation; NaN where the reference moves by less than 1° (SD)
    rmse_deg: float  # [deg]
    bias_deg: float  # [deg] mean of method − reference
    samples: int  # [-] instants compared

    @property
    def sd_deg(self) -> float:
        """Standard deviation of the differences [deg], n − 1 in the denominator."""
        if self.samples < 2:
            return np.nan
        variance = max(self.rmse_deg**2 - self.bias_deg**2, 0.0)
        return float(np.sqrt(variance * self.samples / (self.samples - 1)))

    @property
    def limits_of_agreement_deg(self) -> tuple[float, float]:
        """Bias ∓ 1.96 standard deviations [deg]: Bland & Altman (1986), Lancet 327:307."""
        return self.bias_deg - 1.96 * self.sd_deg, self.bias_deg + 1.96 * self.sd_deg


@dataclass(frozen=True, kw_only=True)
class MethodScores(Stability):
    """All figures of one method."""

    name: str
    angles: Mapping[str, AngleScore]  # by angle
    joint_error_mm: Mapping[str, float]  # [mm] by joint, after one rigid alignment
    shift_s: float  # [s] delay of the method's stamps relative to the reference
    coverage: float  # [-] share of the reference's instants with a skeleton of the method

    @property
    def mean_rmse_deg(self) -> float:
        """Mean RMSE over the angles [deg]."""
        return mean_known([score.rmse_deg for score in self.angles.values()])

    @property
    def mean_leg_rmse_deg(self) -> float:
        """Mean RMSE over hips and knees [deg]."""
        return mean_known([self.angles[name].rmse_deg for name in HIPS_AND_KNEES])

    @property
    def mean_r(self) -> float:
        """Mean correlation over the moving angles [-]."""
        return mean_known([score.r for score in self.angles.values()])

    @property
    def mean_absolute_bias_deg(self) -> float:
        """Mean absolute bias over the angles [deg]."""
        return mean_known([abs(score.bias_deg) for score in self.angles.values()])

    @property
    def mpjpe_mm(self) -> float:
        """Mean error over the joints [mm]."""
        return mean_known(list(self.joint_error_mm.values()))


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Scores of all methods against one reference, over their common time."""

    reference: str  # description of the reference
    synthetic: bool  # whether the subject is a simulated one
    duration_s: float  # [s] evaluated
    methods: tuple[MethodScores, ...]

    @property
    def angle_count(self) -> int:
        """Number of angles that are compared: the reference may lack some."""
        return sum(any(m.angles[name].samples > 1 for m in self.methods) for name in ANGLES)

    def method(self, name: str) -> MethodScores:
        """One method's scores by its name."""
        return next(method for method in self.methods if method.name == name)


def evaluate(methods: Mapping[str, SkeletonSeries], reference: Reference) -> Evaluation:
    """Compare methods with a reference over their common time.

    Args:
        methods: Each method's joints, in any frame, by name.
        reference: The reference.

    Raises:
        InputError: If they do not overlap for at least a second.
    """
    window = common_window(reference, methods)
    return Evaluation(
        reference=reference.name,
        synthetic=reference.synthetic,
        duration_s=float(window.stamps_ns[-1] - window.stamps_ns[0]) * 1e-9,
        methods=tuple(score_method(name, series, window) for name, series in methods.items()),
    )


def common_window(reference: Reference, methods: Mapping[str, SkeletonSeries]) -> Reference:
    """The part of the reference between the first and last sample of every method.

    Raises:
        InputError: If that is less than a second.
    """
    everything = {"the reference": reference.stamps_ns}
    everything |= {name: series.stamps_ns for name, series in methods.items()}
    for name, stamps_ns in everything.items():
        if len(stamps_ns) == 0:
            raise InputError(f"{name} has no skeletons: nothing to evaluate")
    begin_ns = max(int(stamps_ns[0]) for stamps_ns in everything.values())
    end_ns = min(int(stamps_ns[-1]) for stamps_ns in everything.values())
    if end_ns - begin_ns < MIN_OVERLAP_S * 1e9:
        zero_ns = reference.stamps_ns[0]
        spans = ", ".join(
            f"{name} {(stamps_ns[0] - zero_ns) * 1e-9:.1f} to "
            f"{(stamps_ns[-1] - zero_ns) * 1e-9:.1f} s"
            for name, stamps_ns in everything.items()
        )
        raise InputError(f"the recordings do not overlap for {MIN_OVERLAP_S:g} s: {spans}")
    return reference.between(begin_ns, end_ns)


def score_method(name: str, series: SkeletonSeries, reference: Reference) -> MethodScores:
    """Compare one method with a reference, at the reference's instants inside their overlap."""
    known, joints = reference.angles, reference.skeleton
    shift_s = estimate_angle_shift(angle_series(series), known)
    positions = series.shifted(-shift_s).at(reference.stamps_ns)
    expected, found = without_sideways_flexion(known.angles), joint_angles(positions)
    own = series.between(int(reference.stamps_ns[0]), int(reference.stamps_ns[-1]))
    errors_mm = dict.fromkeys(JOINT_INDEX, np.nan)
    if joints is not None:
        errors_mm = joint_errors_mm(positions, joints.at(reference.stamps_ns))
    return MethodScores(
        name=name,
        angles={angle: score_angle(found[angle], expected[angle]) for angle in ANGLES},
        joint_error_mm=errors_mm,
        bone_sd_mm=bone_length_sd_mm(own.positions),
        jerk=rms_jerk(own),
        shift_s=shift_s,
        coverage=float(np.mean(np.any(known_joints(positions), axis=1))),
    )


def score_angle(found: FloatArray, expected: FloatArray) -> AngleScore:
    """Compare two series of one angle [rad], shape (n,); instants with a NaN are left out."""
    known = np.isfinite(found) & np.isfinite(expected)
    count = int(known.sum())
    if count < 2:
        return AngleScore(r=np.nan, rmse_deg=np.nan, bias_deg=np.nan, samples=count)
    expected = anatomical(expected[known])
    error = wrapped(found[known] - expected)
    followed = expected + error  # the method's angle on the reference's turn
    moves = expected.std() > STILL and followed.std() > 0.0
    return AngleScore(
        r=float(np.corrcoef(followed, expected)[0, 1]) if moves else np.nan,
        rmse_deg=float(np.degrees(np.sqrt(np.mean(error**2)))),
        bias_deg=float(np.degrees(error.mean())),
        samples=count,
    )


def joint_errors_mm(positions: FloatArray, reference: FloatArray) -> dict[str, float]:
    """Mean distance [mm] by joint after one rigid alignment of the whole recording.

    Args:
        positions: Joint positions [m] in any frame, shape (n, 15, 3).
        reference: Those of the reference at the same instants, shape (n, 15, 3).
    """
    known = known_joints(positions) & known_joints(reference)
    if known.sum() < 3:
        return dict.fromkeys(JOINT_INDEX, np.nan)
    aligned = rigidly_aligned(positions, reference)
    distance = 1000.0 * np.linalg.norm(aligned - reference, axis=2)
    return {
        name: float(distance[known[:, index], index].mean()) if known[:, index].any() else np.nan
        for name, index in JOINT_INDEX.items()
    }


def rigidly_aligned(positions: FloatArray, target: FloatArray) -> FloatArray:
    """Align positions with a target by one rigid transform (least squares).

    Both (n, 15, 3) [m]; pairs with a NaN are ignored. At least three known pairs are needed.
    """
    known = known_joints(positions) & known_joints(target)
    return transformed(best_rigid_transform(positions[known], target[known]), positions)


def known_joints(positions: FloatArray) -> BoolArray:
    """Mask of the joints with a position, shape (n, 15)."""
    return np.asarray(np.isfinite(positions).all(axis=2))
