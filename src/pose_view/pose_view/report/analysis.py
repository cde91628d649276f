"""All figures of a recording for the report."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from pose_core.api import AngleSeries, SkeletonSeries, angle_series
from pose_evaluation.agreement import (
    MethodStability,
    ViewAgreement,
    measure_agreement,
    measure_stability,
)
from pose_evaluation.gait_cycles import CycleCurve, Cycles, cycle_curves, find_cycles
from pose_evaluation.range_of_motion import AngleRange, ranges_of_motion
from pose_evaluation.reference_alignment import ReferenceAlignment, align_reference
from pose_evaluation.scores import (
    MIN_OVERLAP_S,
    Evaluation,
    evaluate,
    known_joints,
    rigidly_aligned,
)
from pose_evaluation.uncertainty import Coverage, uncertainty_coverage
from pose_io.references.reference import Reference
from pose_view.report.report_data import ReportData

REFERENCE = "reference"
LARGE_SHARE = 0.8  # [-] coverage of the recording required to align the reference
MIN_SHARE = 0.5  # [-] of the longest overlap, required to compare a method


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Comparison of a recording with its reference."""

    reference: Reference  # on the recording's clock
    alignment: ReferenceAlignment
    aligned_with: str  # the method it was aligned with
    left_out: tuple[str, ...]  # methods with too little overlap with the reference
    evaluation: Evaluation
    coverage: Mapping[str, Mapping[str, Coverage]]  # by method, by angle
    joints: SkeletonSeries | None  # the reference's, rigidly aligned with the focus' frame


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """Content of the report."""

    recording: ReportData
    angles: Mapping[str, AngleSeries]  # by method, and the reference's
    compared: Compared | None  # None without a reference
    views: tuple[ViewAgreement, ...]  # of every two sensors
    stability: Mapping[str, MethodStability]  # by method
    ranges: Mapping[str, Mapping[str, AngleRange]]  # by method, by angle
    cycles: Mapping[str, Cycles]  # by side
    cycles_of: str  # the method whose angles determine the cycles
    curves: Mapping[str, Mapping[str, Mapping[str, CycleCurve]]]  # by side, method, angle

    @property
    def is_synthetic(self) -> bool:
        """Whether the subject is a simulated one."""
        of_reference = self.compared is not None and self.compared.reference.synthetic
        return self.recording.is_synthetic or of_reference


def analyse(recording: ReportData, reference: Reference | None) -> Analysis:
    """Compute the figures of a recording, with a reference if there is one.

    Raises:
        InputError: If the reference does not fit the recording.
    """
    angles = {name: angle_series(series) for name, series in recording.methods.items()}
    compared = None if reference is None else compare(recording, reference)
    cycles_of = recording.focus
    if compared is not None:
        angles[REFERENCE] = compared.reference.angles
        cycles_of = REFERENCE
    cycles = find_cycles(angles[cycles_of])
    return Analysis(
        recording=recording,
        angles=angles,
        compared=compared,
        views=measure_agreement(recording.views, recording.T_map_sensor),
        stability={name: measure_stability(each) for name, each in recording.methods.items()},
        ranges={name: ranges_of_motion(each, recording.begin_ns) for name, each in angles.items()},
        cycles=cycles,
        cycles_of=cycles_of,
        curves={
            side: {name: cycle_curves(each, found) for name, each in angles.items()}
            for side, found in cycles.items()
        },
    )


def compare(recording: ReportData, reference: Reference) -> Compared:
    """Compare methods with a reference; those with too little overlap are left out.

    Raises:
        InputError: If the reference does not fit the recording.
    """
    # The focus; if it started late, the first method that covers most of the recording.
    durations_s = {name: series.duration_s for name, series in recording.methods.items()}
    enough_s = LARGE_SHARE * max(durations_s.values())
    names = [recording.focus, *durations_s]
    aligned_with = next(name for name in names if durations_s[name] >= enough_s)
    reference, alignment = align_reference(reference, angle_series(recording.methods[aligned_with]))
    methods, left_out = _long_enough(recording, reference)
    is_synthetic = reference.synthetic or recording.is_synthetic
    evaluation = evaluate(methods, replace(reference, synthetic=is_synthetic))
    return Compared(
        reference=reference,
        alignment=alignment,
        aligned_with=aligned_with,
        left_out=left_out,
        evaluation=evaluation,
        coverage={
            name: uncertainty_coverage(estimates, reference.angles, evaluation.method(name).shift_s)
            for name, estimates in recording.estimates.items()
            if name in methods
        },
        joints=_joints_in_map(recording, reference),
    )


def _long_enough(
    recording: ReportData, reference: Reference
) -> tuple[dict[str, SkeletonSeries], tuple[str, ...]]:
    """The methods whose overlap with the reference is at least half of the longest one."""
    begin_ns, end_ns = int(reference.stamps_ns[0]), int(reference.stamps_ns[-1])
    overlap_s = {
        name: series.between(begin_ns, end_ns).duration_s
        for name, series in recording.methods.items()
    }
    enough_s = max(MIN_OVERLAP_S, MIN_SHARE * max(overlap_s.values()))
    kept = {n: series for n, series in recording.methods.items() if overlap_s[n] >= enough_s}
    # Without any, comparing all methods raises an error with the reason.
    return kept or dict(recording.methods), tuple(n for n in overlap_s if kept and n not in kept)


def _joints_in_map(recording: ReportData, reference: Reference) -> SkeletonSeries | None:
    focus = recording.in_map(recording.focus)
    if reference.skeleton is None or focus is None:
        return None
    target = focus.at(reference.skeleton.stamps_ns)
    if (known_joints(target) & known_joints(reference.skeleton.positions)).sum() < 3:
        return None
    positions = rigidly_aligned(reference.skeleton.positions, target)
    return replace(reference.skeleton, positions=positions)
