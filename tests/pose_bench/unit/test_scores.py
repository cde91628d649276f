import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from pose_bench.accuracy import scores_csv
from pose_bench.means import MethodMeans, ratios
from pose_bench.methods import TimedRun
from pose_bench.scoring import Score, coverage, dof_errors, score
from pose_bench.sessions import SessionSpec, bench_session
from pose_bench.suite import KNOWN, Cell
from pose_bench.summary import failures, tables
from pose_bench.targets import TARGETS, target_table
from pose_core.body.joint_angles import ANGLES
from pose_core.streams.estimate_series import EstimateSeries
from pose_sim.angles import JOINT_NAMES

CELL = Cell(choreography="squats", level="typical", seed=4, condition=KNOWN, duration_s=20.0)


@pytest.fixture(scope="module")
def session():
    spec = SessionSpec(choreography="squats", level="clean", seed=4, duration_s=20.0)
    return bench_session(spec, imus=False)


def run_of(session, shift_ns=0, error=0.0, stddev=0.1):
    """A method that gives the true joints, late, and angles with a constant error [rad]."""
    truth = session.truth
    stamps_ns = truth.stamps_ns + shift_ns
    position = np.stack([session.true_angles[name] for name in JOINT_NAMES], axis=1) + error
    return TimedRun(
        series=replace(truth, stamps_ns=stamps_ns),
        estimates=EstimateSeries(
            stamps_ns=stamps_ns,
            names=JOINT_NAMES,
            position=position,
            position_stddev=np.full_like(position, stddev),
            weight_kinect=np.ones_like(position),
            weight_imu=np.zeros_like(position),
            source=np.ones(position.shape, np.uint8),
            latency_s=np.full(len(stamps_ns), 0.02),
        ),
        latency_s=np.full(len(stamps_ns), 0.02),
        cpu_s=1.0,
    )


def test_the_truth_itself_has_no_error(session):
    found = score(CELL, "truth", run_of(session), session, raw_lag_s=0.0)

    assert found.rmse_deg == pytest.approx(0.0, abs=1e-6)
    assert found.mpjpe_mm == pytest.approx(0.0, abs=1e-6)
    assert found.instants == 1.0
    assert found.within_1 == 1.0


def test_a_late_method_has_a_lag_and_no_error(session):
    found = score(CELL, "late", run_of(session, 60_000_000), session, raw_lag_s=0.045)

    assert found.lag_ms == pytest.approx(60.0, abs=3.0)
    assert found.added_lag_ms == pytest.approx(15.0, abs=3.0)
    assert found.rmse_deg < 0.3
    assert found.latency_ms == pytest.approx(20.0)


def test_errors_of_published_degrees_of_freedom_are_held_against_their_standard_deviations(session):
    for stddev, within in ((0.06, (0.0, 1.0)), (0.04, (0.0, 0.0)), (0.2, (1.0, 1.0))):
        run = run_of(session, error=0.1, stddev=stddev)
        found = score(CELL, "off", run, session, raw_lag_s=0.0)

        assert (found.within_1, found.within_2) == pytest.approx(within, abs=0.01)
        assert found.dof_rmse_deg == pytest.approx(np.degrees(0.1), rel=0.01)


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
    spec = SessionSpec(choreography="arm_raises", level="clean", seed=4, duration_s=26.0)
    session = bench_session(spec, imus=False)

    errors, _ = dof_errors(run_of(session), session, 0.0, ANGLES)["left_shoulder_flexion"]

    sideways = np.abs(session.true_angles["left_shoulder_abduction"]) > np.radians(60.0)
    judged = session.truth.stamps_ns >= session.judged_truth.stamps_ns[0]
    judged &= session.truth.stamps_ns <= session.judged_truth.stamps_ns[-1]
    assert sideways[judged].sum() > 20
    assert np.array_equal(np.isnan(errors), sideways[judged])


def scores_of(rmse):
    """Scores by method and (motion, level) [deg], with a failed one of ``imu``."""
    cells = {
        (motion, level): Cell(
            choreography=motion, level=level, seed=101, condition=KNOWN, duration_s=40.0
        )
        for motion in ("bow", "kicks")
        for level in ("easy", "hard")
    }
    made = [
        Score(cell=cell, method=method, rmse_deg=values[key], mpjpe_mm=10.0 * values[key])
        for key, cell in cells.items()
        for method, values in rmse.items()
    ]
    return [*made, Score(cell=cells["bow", "easy"], method="imu", error="no estimates")]


RMSE = {
    "joint_kf": dict.fromkeys((("bow", "easy"), ("bow", "hard"), ("kicks", "easy")), 10.0)
    | {("kicks", "hard"): 20.0},
    "default": {
        ("bow", "easy"): 4.0,
        ("bow", "hard"): 12.0,
        ("kicks", "easy"): 5.0,
        ("kicks", "hard"): 9.0,
    },
}


def test_the_ratio_is_taken_session_by_session():
    mean = MethodMeans(ratios(scores_of(RMSE)), "default")

    assert mean.rmse_ratio == pytest.approx((0.4 + 1.2 + 0.5 + 0.45) / 4)
    assert mean.worst_cell == ("bow, hard, 101, known", pytest.approx(1.2))
    assert mean.worst_motion == ("bow, hard", pytest.approx(1.2))


def test_targets_show_which_are_met():
    rows = {row[0]: row for row in target_table(ratios(scores_of(RMSE))).rows}

    assert rows["default: RMSE / joint_kf"][2:] == ("0.64", "no")
    assert rows["default: the same, worst motion and level"][2:] == ("1.20", "no")
    assert rows["default: added lag [ms]"][2:] == ("–", "–")
    assert not any(name.startswith("default+imus") for name in rows)
    assert {target.method for target in TARGETS} >= {"default", "default+imus"}


def test_tables_and_csv_name_the_synthetic_subject_and_every_failure():
    scores = scores_of(RMSE)

    text = "\n".join(table.table.markdown() for table in tables(scores))
    rows = list(csv.DictReader(io.StringIO(scores_csv(scores))))

    assert "Synthetic subject" in text
    assert "| bow * |" in text  # tuning may look at it
    assert "| kicks |" in text
    assert len(rows) == len(scores)
    assert {row["subject_kind"] for row in rows} == {"synthetic"}
    assert rows[1]["rmse_to_joint_kf"] == "0.4"
    assert rows[-1]["error"] == "no estimates"
    assert failures(scores) == ["imu on bow, easy, 101, known: no estimates"]
