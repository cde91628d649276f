"""An IMU on a loose strap is believed less, and named (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import EVERY_SEGMENT, START_NS, imu_samples, merged, truth_at

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline

LOOSE = "left_thigh"
SWING = np.array([0.25, 0.0, 0.2])  # [rad] about the sensor's axes
FREQUENCY = 12.0  # [rad/s]
JUDGED_S = 12.0
ANGLES = ("left_hip_flexion", "left_hip_abduction", "left_hip_rotation", "left_knee_flexion")


def swinging(sample):
    """A sample of a sensor that swings; its gyroscope measures that, too."""
    if sample.segment != LOOSE:
        return sample
    phase = FREQUENCY * (sample.stamp_ns - START_NS) * 1e-9
    swing = Rotation.from_rotvec(SWING * np.sin(phase))
    rate = swing.inv().apply(sample.angular_velocity) + SWING * FREQUENCY * np.cos(phase)
    orientation = (Rotation.from_quat(sample.orientation) * swing).as_quat()
    return replace(sample, orientation=orientation, angular_velocity=rate)


@pytest.fixture(scope="module")
def session():
    t, dof = motion(26.0, lean=0.3)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.02)
    return t, dof, skeletons, imu_samples(t, dof, np.random.default_rng(5), segments=EVERY_SEGMENT)


def run(session, imus):
    """Uses of the IMUs by segment, and the spread of the loose link's angle errors [deg]."""
    t, dof, skeletons, _ = session
    pipeline = Pipeline(PipelineParameters(), extrinsics())
    errors = [
        e.position[e.dof_names.index(name)] - truth_at(e, t, dof)[MODEL.dof_index[name]]
        for e in fused(pipeline, merged(skeletons, imus))
        if e.stamp_ns > START_NS + JUDGED_S * 1e9
        for name in ANGLES
    ]
    return {use.segment: use for use in pipeline.imu_uses}, np.degrees(np.std(errors))


@pytest.fixture(scope="module")
def swung(session):
    return run(session, [swinging(sample) for sample in session[3]])


def test_only_the_swinging_imu_is_named(swung):
    uses, _ = swung
    assert [use.segment for use in uses.values() if "times the usual noise" in str(use)] == [LOOSE]
    assert uses[LOOSE].noise > 10.0


def test_the_limb_is_hardly_worse_than_without_the_swinging_imu(session, swung):
    _, without = run(session, [sample for sample in session[3] if sample.segment != LOOSE])
    assert swung[1] < 1.1 * without
