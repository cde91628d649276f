"""zhang2015's limbs: pitch and yaw by Kinect, IMU and both, for visible and occluded limbs."""

from collections.abc import Sequence

import numpy as np

from pose_bench.sessions import BenchSession, SessionSpec, bench_session
from pose_core.api import SkeletonSeries, wrapped
from pose_core.arrays import FloatArray
from pose_core.finite_numbers import mean_known
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_evaluation.limb_attitude import limb_attitude
from pose_evaluation.offline import MethodSetup, run_methods
from pose_evaluation.stability import BONES
from pose_evaluation.table import Table, number_row
from pose_io.arrays import BoolArray, IntArray

CHOREOGRAPHY, LEVEL = "arm_raises", "hard"
ARMS = ("left_upper_arm", "left_forearm", "right_upper_arm", "right_forearm")
SHOWN = (
    MethodSetup(name="left", estimator="left", use_imus=False),
    MethodSetup(name="imu", estimator="imu", use_imus=True),
    MethodSetup(name="zhang2015", estimator="zhang2015", use_imus=True),
    MethodSetup(name="default+imus", estimator="default", use_imus=True),
)
"""The single Kinect of zhang2015, the IMUs, the paper's fusion, the default with two Kinects."""


def limb_table(seeds: Sequence[int]) -> Table:
    """RMS error of pitch and yaw of four arm segments, means over seeds."""
    found = [_errors(seed) for seed in seeds]
    return Table(
        caption="zhang2015, pitch and yaw of the arms: RMS error [°]",
        head="",
        columns=["pitch, seen", "yaw, seen", "pitch, occluded", "yaw, occluded"],
        rows=[
            number_row(
                name, [mean_known(list(of)) for of in np.transpose([e[name] for e in found])], 1
            )
            for name in found[0]
        ],
        note="Synthetic subject that raises its arms; orientations by Madgwick's filter; occluded: "
        "the first Kinect calls an end of the limb inferred or not tracked. Yaw where the limb is "
        "less than 75° steep.",
    )


def _errors(seed: int) -> dict[str, FloatArray]:
    """RMS errors [°] of pitch and yaw, visible and occluded, shape (4,), by method."""
    session = bench_session(
        SessionSpec(choreography=CHOREOGRAPHY, level=LEVEL, seed=seed), imu_filter="madgwick"
    )
    errors = {}
    for name, run in run_methods(session.samples, SHOWN, session.extrinsics).items():
        limbs = [_limb_errors(run.series, session, limb) for limb in ARMS]
        errors[name] = np.array([mean_known(list(column)) for column in zip(*limbs, strict=True)])
    return errors


def _limb_errors(series: SkeletonSeries, session: BenchSession, limb: str) -> list[float]:
    """RMS errors [°] of pitch and yaw, visible, then occluded."""
    truth = session.evaluated_truth
    stamps_ns, first, last = series.stamps_ns, truth.stamps_ns[0], truth.stamps_ns[-1]
    rows = np.flatnonzero((stamps_ns >= first) & (stamps_ns <= last))
    at = np.searchsorted(truth.stamps_ns, stamps_ns[rows])
    found = limb_attitude(series.positions[rows], limb)
    true = limb_attitude(truth.positions[at], limb)
    occluded = _occluded(session, limb, stamps_ns[rows])
    squares = [np.degrees(wrapped(a - b)) ** 2 for a, b in zip(found, true, strict=True)]
    return [
        float(np.sqrt(mean_known(each[rows]))) for rows in (~occluded, occluded) for each in squares
    ]


def _occluded(session: BenchSession, limb: str, stamps_ns: IntArray) -> BoolArray:
    """Whether an end of the limb is not TRACKED in the first Kinect's latest frame."""
    frames = [each for each in session.skeletons if each.sensor == "left"]
    ends = [JOINT_INDEX[joint] for joint in BONES[limb]]
    hidden = np.array([(f.tracking_state[ends] != TrackingState.TRACKED).any() for f in frames])
    stamps = np.array([each.stamp_ns for each in frames], np.int64)
    latest = np.clip(np.searchsorted(stamps, stamps_ns, side="right") - 1, 0, None)
    return hidden[latest]
