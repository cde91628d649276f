"""The headings of two IMUs drift, as by gyroscopes' biases: this is corrected (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import EVERY_SEGMENT, START_NS, imu_samples, merged, truth_at

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline

DRIFTS = {"left_thigh": np.radians(2.0), "right_forearm": np.radians(-2.0)}  # [rad/s]
JUDGED_S = 20.0
ANGLES = ("left_hip_rotation", "left_hip_abduction", "right_elbow_flexion")


def drifting(sample):
    """A sample of a sensor without magnetometer, whose gyroscope has a bias about the vertical."""
    rate = np.array([0.0, 0.0, DRIFTS.get(sample.segment, 0.0)])
    orientation = Rotation.from_quat(sample.orientation)
    turned = Rotation.from_rotvec(rate * (sample.stamp_ns - START_NS) * 1e-9) * orientation
    biased = sample.angular_velocity + orientation.inv().apply(rate)
    return replace(sample, orientation=turned.as_quat(), angular_velocity=biased)


@pytest.fixture(scope="module")
def session():
    t, dof = motion(40.0, lean=0.3)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.02)
    return t, dof, skeletons, imu_samples(t, dof, np.random.default_rng(5), segments=EVERY_SEGMENT)


def run(session, imus):
    """Uses of the IMUs by segment, and the RMS error of the angles beside them [deg]."""
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
def drifted(session):
    return run(session, [drifting(sample) for sample in session[3]])


def test_drifts_are_found_and_only_those_imus_are_named(drifted):
    uses, _ = drifted
    named = {segment for segment, use in uses.items() if "its heading drifts by" in str(use)}
    assert named == set(DRIFTS)
    for segment, use in uses.items():
        assert use.heading_drift == pytest.approx(-DRIFTS.get(segment, 0.0), abs=np.radians(0.4))


def test_the_limbs_are_hardly_worse_than_with_headings_that_do_not_drift(session, drifted):
    _, without = run(session, session[3])
    assert drifted[1] < 1.1 * without
