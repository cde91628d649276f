"""Calibration of IMUs with an inexact N-pose (synthetic)."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import IMU_SEGMENTS, imu_samples, merged

from pose_calibration.imus.imu_calibration import ImuCalibration
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_core.streams.samples import SkeletonSample, block_of

STILL_S = 3.0
STOOD_DEG = {
    "left_shoulder_abduction": 12.0,
    "left_shoulder_flexion": 5.0,
    "left_elbow_flexion": 15.0,
    "left_hip_rotation": -10.0,  # toes out
    "left_hip_abduction": 4.0,
    "left_knee_flexion": 4.0,
}
SEED = 5


@pytest.fixture(scope="module")
def errors_deg():
    """Errors of the alignments found [deg], (3,) by segment."""
    t, dof = motion(24.0, still_s=STILL_S)
    moving = np.clip((t - STILL_S) / 2.0, 0.0, 1.0) ** 2
    for name, angle in STOOD_DEG.items():
        dof[:, MODEL.dof_index[name]] += np.radians(angle) * (1.0 - moving)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.02)
    calibration = ImuCalibration(ImuCalibrationParameters(), extrinsics())
    for sample in merged(skeletons, imu_samples(t, dof, np.random.default_rng(SEED))):
        calibration.add(sample if isinstance(sample, SkeletonSample) else block_of(sample))
    alignments = calibration.finish().alignments
    rng = np.random.default_rng(SEED)  # draws the straps as worn_imus does
    true = {name: Rotation.from_rotvec(rng.normal(0.0, 0.3, 3)).inv() for name in IMU_SEGMENTS}
    return {
        name: np.degrees(
            (true[name].inv() * Rotation.from_matrix(each.R_sensor_segment)).as_rotvec()
        )
        for name, each in alignments.items()
    }


@pytest.mark.parametrize("segment", ["left_thigh", "left_shank"])
def test_toes_turned_out_in_the_stand_are_put_right_by_the_knee(errors_deg, segment):
    assert abs(errors_deg[segment][2]) < 2.0


def test_arms_that_hang_aside_and_bent_are_put_right_by_their_motion(errors_deg):
    assert np.abs(errors_deg["left_upper_arm"]).max() < 6.0  # stood 12 beside
    assert np.abs(errors_deg["left_forearm"]).max() < 4.0  # stood 23 beside
