import numpy as np
import pytest

from pose_bench.scoring import coverage, dof_errors, truth_of_series
from pose_bench.sessions import SessionSpec, bench_session
from pose_core.body.joint_angles import ANGLES
from pose_core.streams.estimate_series import EstimateSeries
from pose_evaluation.offline import MethodRun


def truth_of(choreography, duration_s):
    spec = SessionSpec(choreography=choreography, level="clean", seed=4, duration_s=duration_s)
    session = bench_session(spec, imus=False)
    return truth_of_series(session.truth, int(session.judged_truth.stamps_ns[0]))


def run_of(truth, error=0.0, stddev=0.1):
    """A method that gives the true joints, and angles with a constant error [rad]."""
    stamps_ns = truth.whole.stamps_ns
    position = np.stack([truth.angles[name] for name in ANGLES], axis=1) + error
    return MethodRun(
        series=truth.whole,
        estimates=EstimateSeries(
            stamps_ns=stamps_ns,
            names=ANGLES,
            position=position,
            position_stddev=np.full_like(position, stddev),
            weight_kinect=np.ones_like(position),
            weight_imu=np.zeros_like(position),
            source=np.ones(position.shape, np.uint8),
            latency_s=np.full(len(stamps_ns), 0.02),
        ),
    )


def test_errors_of_published_degrees_of_freedom_are_held_against_their_standard_deviations():
    truth = truth_of("squats", 20.0)
    for stddev, within in ((0.06, (0.0, 1.0)), (0.04, (0.0, 0.0)), (0.2, (1.0, 1.0))):
        errors = dof_errors(run_of(truth, error=0.1, stddev=stddev), truth, 0.0)

        assert coverage(errors) == pytest.approx(within, abs=0.01)
        for error, _ in errors.values():
            assert error[np.isfinite(error)] == pytest.approx(0.1, abs=1e-6)


def test_normal_errors_are_covered_as_they_should_be():
    rng = np.random.default_rng(3)
    stddev = rng.uniform(0.05, 0.5, 20_000)

    within = coverage({"knee": (stddev * rng.standard_normal(20_000), stddev)})

    assert within == pytest.approx((0.683, 0.954), abs=0.01)


def test_unknown_standard_deviations_and_errors_do_not_count():
    error, stddev = np.array([0.1, np.nan, 0.1, 9.0]), np.array([0.2, 0.2, 0.2, np.nan])

    assert coverage({"knee": (error, stddev)}) == (1.0, 1.0)
    assert np.isnan(coverage({})).all()


def test_flexion_of_a_limb_that_points_sideways_is_left_out():
    truth = truth_of("arm_raises", 26.0)

    errors, _ = dof_errors(run_of(truth), truth, 0.0)["left_shoulder_flexion"]

    sideways = np.abs(truth.angles["left_shoulder_abduction"]) > np.radians(60.0)
    judged = truth.whole.stamps_ns >= truth.judged.stamps_ns[0]
    assert sideways[judged].sum() > 20
    assert np.array_equal(np.isnan(errors), sideways[judged])
