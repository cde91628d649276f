"""The pose predicted to instants between frames (synthetic motion)."""

import numpy as np
import pytest
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline

MS = 1_000_000
START_NS = 10**18


@pytest.fixture(scope="module")
def moving():
    t, dof = motion(8.0)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(6), 0.003)
    return t, positions, samples


def fed(samples, ask_after_ns=()):
    """Estimates, and the predictions asked for after each."""
    pipeline = Pipeline(PipelineParameters(output_rate=0.0), extrinsics())
    estimates, predictions = [], []
    for sample in samples:
        new = pipeline.add(sample)
        estimates += new
        predictions += [[pipeline.predict(e.stamp_ns + ns) for ns in ask_after_ns] for e in new]
    return estimates, predictions


def test_a_prediction_is_more_accurate_than_holding_the_last_output(moving):
    t, positions, samples = moving
    late_ns = 20 * MS
    estimates, predictions = fed(samples, [late_ns])
    flat = positions.reshape(len(t), -1)

    def error(poses):
        now_s = np.array([(e.stamp_ns + late_ns - START_NS) * 1e-9 for e in estimates])
        inside = (now_s > 5.0) & (now_s < t[-1])
        true = np.stack([np.interp(now_s, t, column) for column in flat.T], axis=1)
        told = np.array([pose.joints.ravel() for pose in poses])
        return np.sqrt(np.mean((told - true)[inside] ** 2))

    assert error([p for (p,) in predictions]) < 0.8 * error(estimates)


def test_deviation_grows_with_the_prediction_horizon(moving):
    *_, samples = moving
    estimates, predictions = fed(samples[:300], [0, 10 * MS, 50 * MS, 200 * MS])
    for estimate, ahead in zip(estimates[60:], predictions[60:], strict=True):
        assert [p.stamp_ns - estimate.stamp_ns for p in ahead] == [0, 10 * MS, 50 * MS, 200 * MS]
        spread = np.array([np.mean(p.position_stddev[6:] ** 2) for p in ahead])
        assert (np.diff(spread) > 0.0).all()
        np.testing.assert_allclose(ahead[0].joints, estimate.joints, atol=5e-3)
        assert (ahead[-1].source == 0).all()  # predicted


def test_there_is_no_prediction_before_the_first_pose_or_long_after_the_last_frame(moving):
    *_, samples = moving
    pipeline = Pipeline(PipelineParameters(output_rate=0.0), extrinsics())
    assert pipeline.predict(START_NS) is None
    last = [e for sample in samples[:200] for e in pipeline.add(sample)][-1]
    assert pipeline.predict(last.stamp_ns + 100 * MS) is not None
    assert pipeline.predict(last.stamp_ns + 1500 * MS) is None
    assert pipeline.predict(last.stamp_ns - 200 * MS) is None


def test_predictions_have_their_own_stamp_and_do_not_consume_estimates(moving):
    *_, samples = moving
    asked, given = [], []
    pipeline = Pipeline(PipelineParameters(output_rate=100.0), extrinsics())
    for index, sample in enumerate(samples):
        given += pipeline.add(sample)
        if index > 150 and index % 10 == 0:
            now_ns = sample.stamp_ns + 5 * MS
            asked.append((now_ns, pipeline.predict(now_ns)))
    given += pipeline.flush()
    assert all(pose is not None and pose.stamp_ns == now_ns for now_ns, pose in asked)
    stamps_ns = np.array([e.stamp_ns for e in given])
    assert (np.diff(stamps_ns) == 10 * MS).all()
