import numpy as np
import pytest

from pose_fusion.body.model import load_body_model
from pose_fusion.fusion.estimators.estimator import FusedPose
from pose_fusion.fusion.estimators.uncertainty import FITTING, Uncertainty

MODEL = load_body_model("default")
KNEE, NECK = (MODEL.dof_names.index(name) for name in ("left_knee_flexion", "neck_flexion"))


def pose(velocity=0.0, weight_imu=0.0):
    size = MODEL.size
    return FusedPose(
        position=np.zeros(size),
        velocity=np.full(size, velocity),
        variance=np.full(size, 0.01),
        weight_kinect=np.full(size, 1.0 - weight_imu),
        weight_imu=np.full(size, weight_imu),
        source=np.zeros(size, np.uint8),
        rotations=np.zeros((11, 3, 3)),
        joints=np.zeros((15, 3)),
        sensor_weight=np.zeros((1, 15)),
    )


def test_variances_stay_where_the_distances_fit():
    variance = Uncertainty(MODEL).variance(pose(), FITTING)

    assert variance[NECK] == pytest.approx(0.01)


def test_measurements_that_surprise_make_the_pose_less_certain():
    uncertainty = Uncertainty(MODEL)
    before = uncertainty.variance(pose(), uncertainty.distance)
    for _ in range(300):
        uncertainty.note(1.0 / 30.0, np.full(15, 8.0))
    after = uncertainty.variance(pose(), uncertainty.distance)

    assert np.all(after > 1.5 * before)


def test_a_quick_joint_is_less_certain_than_a_still_one():
    uncertainty = Uncertainty(MODEL)

    still, quick = (uncertainty.variance(pose(v), 1.0)[KNEE] for v in (0.0, 2.0))

    assert quick > 1.5 * still


def test_an_imu_makes_a_quick_joint_more_certain():
    uncertainty = Uncertainty(MODEL)

    alone, worn = (uncertainty.variance(pose(2.0, w), 0.5)[KNEE] for w in (0.0, 0.6))

    assert worn < alone


def test_distances_that_nothing_tells_change_nothing():
    uncertainty = Uncertainty(MODEL)
    before = uncertainty.distance
    uncertainty.note(1.0, np.full(15, np.nan))

    assert uncertainty.distance == before
