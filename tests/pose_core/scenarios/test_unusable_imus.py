"""IMUs that are not worn, or whose reference frames are upside down, on a captured person."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_bench.captured import METHODS, run_method, true_extrinsics, truth_of
from pose_bench.captured_suite import captured_specs
from pose_evaluation.scores import score_method
from pose_io.references.reference import reference_of_skeleton
from pose_sim.captured.session import make_captured_session

LYING = "left_forearm"
TURNED_OVER = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
WITH_IMUS = next(method for method in METHODS if method.name == "default+imus")


@pytest.fixture(scope="module")
def session():
    spec = replace(captured_specs(None, held_out=False, seed=7)[0], duration_s=30.0)
    return make_captured_session(spec)


def run(session):
    """RMS error of the angles [deg], and the uses of the IMUs by segment."""
    made, pipeline = run_method(session, WITH_IMUS, true_extrinsics(session))
    score = score_method(
        "default+imus", made.series, reference_of_skeleton("truth", truth_of(session))
    )
    return score.mean_rmse_deg, {use.segment: use for use in pipeline.imu_uses}


@pytest.fixture(scope="module")
def usual(session):
    return run(session)


def lying(stream):
    """The stream of an IMU that lies on a table."""
    rng = np.random.default_rng(3)
    count = len(stream.stamps_s)
    trembling = Rotation.from_rotvec(rng.normal(0.0, 0.0005, (count, 3)))
    return replace(
        stream,
        orientation=(Rotation.from_rotvec([0.3, -0.2, 1.0]) * trembling).as_quat(),
        angular_velocity=rng.normal(0.0, 0.01, (count, 3)),
    )


def turned_over(stream):
    """The stream of an IMU whose reference frame has a z axis that points down."""
    orientation = TURNED_OVER * Rotation.from_quat(stream.orientation)
    return replace(stream, orientation=orientation.as_quat())


def test_an_imu_on_the_table_is_named_and_changes_nothing(session):
    without = [stream for stream in session.imus if stream.segment != LYING]
    laid_down = [lying(each) if each.segment == LYING else each for each in session.imus]
    rmse, uses = run(replace(session, imus=laid_down))
    assert uses[LYING].reason.startswith("it has not turned by 8° yet")
    assert uses[LYING].frames_used == 0
    assert [use.segment for use in uses.values() if use.exchanged_with] == []
    assert rmse == pytest.approx(run(replace(session, imus=without))[0], rel=0.02)


def fallen(stream, at_s=15.0, lasts_s=0.6):
    """The stream of an IMU that falls off and lies there from then on."""
    first = np.searchsorted(stream.stamps_s, at_s)
    orientation, rate = stream.orientation.copy(), stream.angular_velocity.copy()
    before = Rotation.from_quat(orientation[first])
    turn = (before.inv() * Rotation.from_rotvec([0.3, -2.2, 1.0])).as_rotvec()
    share = np.clip((stream.stamps_s[first:] - at_s) / lasts_s, 0.0, 1.0)
    orientation[first:] = (before * Rotation.from_rotvec(share[:, None] * turn)).as_quat()
    rate[first:] = np.where(share[:, None] < 1.0, turn / lasts_s, 0.0)
    return replace(stream, orientation=orientation, angular_velocity=rate)


def test_an_imu_that_falls_off_is_named_and_harms_for_a_moment(session):
    """A thigh's, whose fall turns the link by 140 degrees in the estimate."""
    others = [stream for stream in session.imus if stream.segment != "right_thigh"]
    falling = [fallen(each) if each.segment == "right_thigh" else each for each in session.imus]
    rmse, uses = run(replace(session, imus=falling))
    assert uses["right_thigh"].contradictions == 1
    assert not uses["right_thigh"].is_aligned
    assert rmse < 1.1 * run(replace(session, imus=others))[0]


def test_imus_whose_z_axes_point_down_are_turned_over(session, usual):
    rmse, uses = run(replace(session, imus=[turned_over(each) for each in session.imus]))
    assert all("points down (NED): turned over" in use.remark for use in uses.values())
    assert all(use.is_aligned for use in uses.values())
    assert rmse < 1.05 * usual[0]


def test_of_sound_imus_none_is_turned_over(usual):
    _, uses = usual
    assert [use.segment for use in uses.values() if "points down" in use.remark] == []
