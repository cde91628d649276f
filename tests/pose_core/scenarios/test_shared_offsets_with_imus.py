"""Cameras that all see a knee too far forward: IMUs on the leg find that out (synthetic)."""

import numpy as np
import pytest
from fusing import fused
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import EVERY_SEGMENT, START_NS, imu_samples, merged, truth_at

from pose_core.estimators.default import DefaultEstimator
from pose_core.estimators.parameters import PipelineParameters
from pose_core.filter.tuning import CameraNoise, FilterTuning
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX

FORWARD = 0.02  # [m] in the body's heading
JUDGED_S = 15.0
ANGLES = ("left_hip_flexion", "left_knee_flexion")


@pytest.fixture(scope="module")
def session():
    t, dof = motion(30.0, lean=0.3)
    seen = kinematics().pose(dof).positions
    knee, heading = seen[:, JOINT_INDEX["left_knee"]], dof[:, 5]
    knee[:, 0] += FORWARD * np.cos(heading)
    knee[:, 1] += FORWARD * np.sin(heading)
    skeletons = skeleton_samples(seen, extrinsics(), np.random.default_rng(2), 0.01)
    imus = imu_samples(t, dof, np.random.default_rng(5), segments=EVERY_SEGMENT)
    return t, dof, merged(skeletons, imus)


def bias_deg(session, camera):
    """Mean error [deg] of the left leg's flexions with some noise of the cameras."""
    t, dof, samples = session

    def make(*args, **keywords):
        return DefaultEstimator(*args, tuning=FilterTuning(camera=camera), **keywords)

    pipeline = Pipeline(PipelineParameters(), extrinsics(), make_estimator=make)
    errors = [
        [
            e.position[e.dof_names.index(name)] - truth_at(e, t, dof)[MODEL.dof_index[name]]
            for name in ANGLES
        ]
        for e in fused(pipeline, samples)
        if e.stamp_ns > START_NS + JUDGED_S * 1e9
    ]
    return np.degrees(np.abs(np.mean(errors, axis=0)))


def test_an_offset_that_all_cameras_share_does_not_pass_into_the_imus_alignment(session):
    found = bias_deg(session, CameraNoise())
    believed = bias_deg(session, CameraNoise(shared_offset_stddev=0.0))
    assert np.all(believed > 2.0)
    assert np.all(found < 0.6 * believed)
