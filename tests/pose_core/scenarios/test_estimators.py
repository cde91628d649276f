"""Every estimator of the registry, through the same door."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples

from pose_core.errors import ParameterError
from pose_core.estimators import ESTIMATORS
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX
from pose_core.kernels.published_state import Source

START_NS = 10**18
WITH_CAMERAS = [name for name in ESTIMATORS if name != "imu"]


def make(name):
    return Pipeline(PipelineParameters(estimator=name), extrinsics())


@pytest.fixture(scope="module")
def session():
    t, dof = motion(6.0)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.005)
    return t, dof, positions, samples


@pytest.mark.parametrize("name", WITH_CAMERAS)
def test_every_estimator_tracks_a_knee_and_is_deterministic(name, session):
    t, dof, positions, samples = session
    estimates = fused(make(name), samples)
    assert len(estimates) > 100
    index = estimates[0].dof_names.index("left_knee_flexion")
    times = [(e.stamp_ns - START_NS) * 1e-9 for e in estimates]
    truth = np.interp(times, t, dof[:, MODEL.dof_index["left_knee_flexion"]])
    found = np.array([e.position[index] for e in estimates])
    assert np.degrees(np.sqrt(np.mean((found - truth) ** 2))) < 9.0
    knee = JOINT_INDEX["left_knee"]
    path = np.stack([np.interp(times, t, column) for column in positions[:, knee].T], axis=1)
    error = np.linalg.norm([e.joints[knee] for e in estimates] - path, axis=1)
    assert np.mean(error) < 0.04
    assert estimates[-1].source[index] == Source.KINECT

    pipeline = make(name)
    again = [e for sample in samples[:-20] for e in pipeline.add(sample)]
    assert len(again) > 20
    for one, other in zip(estimates, again, strict=False):
        np.testing.assert_array_equal(one.position, other.position)
        np.testing.assert_array_equal(one.joints, other.joints)


def test_an_estimator_named_after_a_sensor_uses_only_that_sensor(session):
    samples = session[3]
    moved = [replace(s, positions=s.positions + 1.0) if s.sensor == "left" else s for s in samples]
    for one, other in zip(fused(make("right"), samples), fused(make("right"), moved), strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=1e-9)


def test_an_estimator_of_an_absent_sensor_is_refused():
    parameters = PipelineParameters(estimator="right", sensors=("left",))
    with pytest.raises(ParameterError, match="the sensors are left"):
        Pipeline(parameters)
