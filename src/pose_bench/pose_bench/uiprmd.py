"""One real Kinect against a real Vicon: the raw skeleton and estimates from it.

UI-PRMD (Vakanski et al. 2018, Data 3(1):2): rehabilitation exercises, one file per repetition of
two to four seconds. An estimator processes all repetitions of a subject as one session, the first
of them twice, to measure the body. Between repetitions there is no person for a second, then the
first frame is held for another second, since a file begins in the middle of a recording. Each
repetition is evaluated separately: after one time shift and without the mean error, since the two
systems define joints differently. The Kinect's files have no stamps and its rate was not always
30 Hz: each is stretched to the duration that fits the raw view best.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pose_bench.frame_rate import time_stretch
from pose_bench.one_camera import RAW, CameraView, run_one_camera, view_of, view_of_stream
from pose_bench.tables import method_table
from pose_core.api import (
    ANGLES,
    AngleSeries,
    SkeletonSample,
    SkeletonSeries,
    angle_series,
    unwrapped,
    without_sideways_flexion,
    wrapped,
)
from pose_core.arrays import FloatArray
from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_core.finite_numbers import mean_known
from pose_evaluation.scores import AngleScore, score_angle
from pose_evaluation.table import Table
from pose_io.recordings.formats import read_recording
from pose_io.references.uiprmd import read_uiprmd

FILE = re.compile(r"m(?P<movement>\d\d)_s(?P<subject>\d\d)_e\d\d_positions\.txt(\.gz)?$")
MOVEMENTS = {
    "01": "deep squat",
    "02": "hurdle step",
    "03": "inline lunge",
    "04": "side lunge",
    "05": "sit to stand",
    "06": "leg raise",
    "07": "shoulder abduction",
    "08": "shoulder extension",
    "09": "shoulder rotation",
    "10": "shoulder scaption",
}
UNSEEN_NS = 1_000_000_000  # [ns] between repetitions
STILL_FRAMES = 30  # number of copies of the first frame before each repetition
FRAME_NS = 33_333_333  # [ns]
MOVING = np.radians(20.0)  # [rad] smallest range of an evaluated angle
MAX_SHIFT_NS = 300_000_000  # [ns] largest time shift between the two systems' files
STEP_NS = 10_000_000  # [ns]
LEFT_OUT = ("without_vicon", "not_cut_alike")
CUT_ALIKE_S = 0.5  # [s] largest difference in duration between the two files of a repetition


@dataclass(frozen=True, kw_only=True)
class Repetition:
    """One repetition, recorded by both systems."""

    name: str  # of its file
    movement: str
    subject: str
    view: CameraView
    vicon: AngleSeries


@dataclass(frozen=True, kw_only=True)
class AngleAgreement:
    """Agreement of one angle of one repetition with the Vicon's."""

    movement: str
    subject: str
    repetition: str  # the file
    angle: str
    method: str  # RAW, or an estimator
    sd_deg: float  # [deg] RMSE without the mean error
    r: float  # [-] Pearson's


def read_repetitions(folder: Path) -> tuple[list[Repetition], Counters]:
    """Read every repetition with a Kinect and a Vicon file; count those left out, by reason.

    Raises:
        InputError: If there are none, or one is damaged.
    """
    used = []
    left_out = Counters(*LEFT_OUT)
    for path in sorted((folder / "Kinect" / "Positions").glob("m*_positions.txt*")):
        match = FILE.match(path.name)
        vicon = folder / "Vicon" / "Positions" / path.name
        if match is None or not vicon.is_file():
            left_out.add("without_vicon")
            continue
        repetition = Repetition(
            name=path.name.partition("_positions")[0],
            movement=match["movement"],
            subject=match["subject"],
            view=view_of_stream(read_recording(path, "uiprmd").streams[0]),
            vicon=read_uiprmd(vicon).angles,
        )
        vicon_s = 1e-9 * float(np.ptp(repetition.vicon.stamps_ns))
        if abs(repetition.view.series.duration_s - vicon_s) > CUT_ALIKE_S:
            left_out.add("not_cut_alike")
            continue
        used.append(_in_true_time(repetition))
    if not used:
        raise InputError(
            f"found no repetition of UI-PRMD in {folder}: expected Kinect/Positions/mMM_sSS_eEE_"
            "positions.txt and the same in Vicon/Positions, with Angles beside them"
        )
    return used, left_out


def _in_true_time(repetition: Repetition) -> Repetition:
    """A repetition with the stamps that fit the Vicon best."""
    vicon = repetition.vicon
    stretch = time_stretch(angle_series(repetition.view.series), vicon, _moving(vicon))
    samples = [
        replace(sample, stamp_ns=round(stretch * sample.stamp_ns))
        for sample in repetition.view.samples
    ]
    return replace(repetition, view=view_of(samples))


def compare_subject(repetitions: Sequence[Repetition], estimator: str) -> list[AngleAgreement]:
    """Evaluate all repetitions of one subject as one session.

    Args:
        repetitions: The subject's repetitions.
        estimator: An estimator, or :data:`RAW` for the raw view.
    """
    starts = _starts(repetitions)
    if estimator == RAW:
        made = [repetition.view.series for repetition in repetitions]
    else:
        samples = [
            sample
            for repetition, start_ns in zip((repetitions[0], *repetitions), starts, strict=True)
            for sample in _led_in(repetition.view.shifted(start_ns).samples)
        ]
        estimate = run_one_camera(estimator, samples).series
        made = [
            _cut(estimate, repetition, start_ns)
            for repetition, start_ns in zip(repetitions, starts[1:], strict=True)
        ]
    return [
        each
        for repetition, series in zip(repetitions, made, strict=True)
        for each in _agreements(repetition, series, estimator)
    ]


def _cut(estimate: SkeletonSeries, repetition: Repetition, start_ns: int) -> SkeletonSeries:
    """The part of a session's estimate of a repetition, on the repetition's time."""
    stamps_ns = repetition.view.series.stamps_ns + start_ns
    own = estimate.between(int(stamps_ns[0]), int(stamps_ns[-1]))
    return own.shifted(-start_ns * 1e-9)


def _starts(repetitions: Sequence[Repetition]) -> list[int]:
    """Start of each repetition [ns], the first one twice."""
    pause_ns = UNSEEN_NS + STILL_FRAMES * FRAME_NS
    starts = [pause_ns]
    for repetition in (repetitions[0], *repetitions[:-1]):
        duration_ns = int(repetition.view.series.stamps_ns[-1])
        starts.append(starts[-1] + duration_ns + pause_ns)
    return starts


def _led_in(samples: Sequence[SkeletonSample]) -> list[SkeletonSample]:
    """A repetition preceded by copies of its first frame."""
    first = samples[0]
    still = [
        replace(first, stamp_ns=first.stamp_ns - ago * FRAME_NS)
        for ago in range(STILL_FRAMES, 0, -1)
    ]
    return [*still, *samples]


def _agreements(
    repetition: Repetition, series: SkeletonSeries, method: str
) -> list[AngleAgreement]:
    """Agreement of the moving angles."""
    moving = _moving(repetition.vicon)
    found = agreement(series, repetition.vicon, moving)
    return [
        AngleAgreement(
            movement=MOVEMENTS.get(repetition.movement, repetition.movement),
            subject=repetition.subject,
            repetition=repetition.name,
            angle=angle,
            method=method,
            sd_deg=found[angle].sd_deg,
            r=found[angle].r,
        )
        for angle in moving
    ]


def agreement(
    series: SkeletonSeries, vicon: AngleSeries, angles: Sequence[str]
) -> dict[str, AngleScore]:
    """Agreement of some angles with the Vicon's, after the best common time shift.

    The shift has the smallest errors about their mean: correlation is not suitable where an arm
    moves overhead and its flexion wraps.
    """
    own = angle_series(series)
    true = without_sideways_flexion(vicon.angles)
    scored = []
    for shift_ns in np.arange(-MAX_SHIFT_NS, MAX_SHIFT_NS + 1, STEP_NS):
        found = own.at(vicon.stamps_ns + shift_ns)
        scored.append({angle: _score(found[angle], true[angle]) for angle in angles})
    sd = [mean_known([score.sd_deg for score in scores.values()]) for scores in scored]
    return scored[int(np.nanargmin(sd))] if np.isfinite(sd).any() else scored[0]


def _score(found: FloatArray, true: FloatArray) -> AngleScore:
    """Score of an angle without its mean error, which may be near 180°."""
    error = wrapped(found - true)
    error = error[np.isfinite(error)]
    if len(error) == 0:
        return score_angle(found, true)
    mean = float(np.angle(np.mean(np.exp(1j * error))))
    return score_angle(found - mean, true)


def _moving(vicon: AngleSeries) -> list[str]:
    """The angles whose range is at least :data:`MOVING`."""
    true = without_sideways_flexion(vicon.angles)
    return [angle for angle in ANGLES if _range(true[angle]) >= MOVING]


def _range(angle: FloatArray) -> float:
    """Range of an angle [rad]; 0 if it is unknown for most of the time."""
    known = unwrapped(angle)[np.isfinite(angle)]
    return float(np.ptp(known)) if len(known) > len(angle) // 2 else 0.0


def table(found: Sequence[AngleAgreement]) -> Table:
    """A row per movement, and the mean; a column per method."""
    methods = len({each.method for each in found})
    groups = []
    for movement in dict.fromkeys(each.movement for each in found):
        own = [each for each in found if each.movement == movement]
        groups.append((movement, str(len(own) // methods), own))
    return method_table(
        "UI-PRMD: one Kinect v2 against Vicon",
        ("movement", "angles"),
        groups,
        ("mean of the movements", str(len(found) // methods)),
        {"[°]": ("sd_deg", 1), "r": ("r", 3)},
        "Real people. RMSE after the mean error is taken off, and Pearson's r, of the angles "
        f"that move by {np.degrees(MOVING):.0f}° or more, after one time shift a repetition; "
        "mean over angles and repetitions. Shoulder rotation moves none of the angles.",
    )
