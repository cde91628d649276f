import numpy as np
import pytest
from moving_body import motion
from scipy.spatial.transform import Rotation

from pose_core.joints import JOINT_INDEX
from pose_evaluation.methods import aligned_frames, mean_series


def transform(seed):
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    T[:3, 3] = seed, -seed, 1.0
    return T


@pytest.fixture
def extrinsics():
    return {"left": transform(1), "right": transform(2)}


@pytest.fixture
def views(extrinsics):
    """Two sensors on their own phase, each in its own frame."""
    return {
        "left": motion(rate=30.0).transformed(np.linalg.inv(extrinsics["left"])),
        "right": motion(rate=30.0, begin_s=0.012).transformed(np.linalg.inv(extrinsics["right"])),
    }


def test_the_mean_of_two_perfect_views_is_the_body_itself(views, extrinsics):
    mean = mean_series(views, extrinsics)
    truth = motion(rate=1000.0, duration_s=13.0)
    error = np.linalg.norm(mean.positions - truth.at(mean.stamps_ns), axis=2)
    assert error.max() < 0.002  # what a straight line leaves of an arc


def test_the_mean_has_about_as_many_frames_as_one_sensor(views, extrinsics):
    assert len(mean_series(views, extrinsics)) == pytest.approx(len(views["left"]), abs=2)


def test_a_joint_that_one_sensor_misses_is_the_other_s(views, extrinsics):
    views["left"].positions[:, JOINT_INDEX["left_hand"]] = np.nan
    mean = mean_series(views, extrinsics)
    truth = motion(rate=1000.0, duration_s=13.0)
    error = np.linalg.norm(mean.positions - truth.at(mean.stamps_ns), axis=2)
    seen = error[:, JOINT_INDEX["left_hand"]]
    assert np.nanmax(seen) < 0.002
    assert np.isfinite(seen).mean() > 0.95


def test_a_joint_that_nobody_sees_is_unknown(views, extrinsics):
    for view in views.values():
        view.positions[:, JOINT_INDEX["head"]] = np.nan
    assert np.isnan(mean_series(views, extrinsics).positions[:, JOINT_INDEX["head"]]).all()


def test_an_offset_of_one_sensor_is_halved(views, extrinsics):
    extrinsics["right"][2, 3] += 0.10
    mean = mean_series(views, extrinsics)
    truth = motion(rate=1000.0, duration_s=13.0)
    offset = (mean.positions - truth.at(mean.stamps_ns))[5:-5, :, 2].mean()
    assert offset == pytest.approx(0.05, abs=0.002)


def test_frames_hold_both_sensors_at_one_instant(views):
    frames = list(aligned_frames(views))
    both = [frame for frame in frames if len(frame.samples) == 2]
    assert len(both) > 0.95 * len(frames)
    assert all(s.stamp_ns == f.stamp_ns for f in both for s in f.samples.values())
