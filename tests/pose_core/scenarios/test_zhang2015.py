"""The paper's fusion on a synthetic body: one Kinect's raw limbs and IMUs."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from synthetic_body import MODEL, extrinsics
from worn_imus import START_NS, merged, moving_wearer, truth_at

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_core.kernels.published_state import Source

KNEE = MODEL.dof_index["left_knee_flexion"]
HIDDEN_FROM_NS = START_NS + 24 * 10**9


@pytest.fixture(scope="module")
def session():
    return moving_wearer(27.0)


def run(samples, estimator="zhang2015"):
    pipeline = Pipeline(PipelineParameters(estimator=estimator), extrinsics())
    return pipeline, fused(pipeline, samples)


def with_foot(skeletons, state, aside=0.0):
    """The skeletons; late ones with a foot that is hidden, and elsewhere [m]."""
    changed = []
    for sample in skeletons:
        if sample.stamp_ns > HIDDEN_FROM_NS:
            states, positions = sample.tracking_state.copy(), sample.positions.copy()
            states[JOINT_INDEX["left_foot"]] = state
            positions[JOINT_INDEX["left_foot"], 0] += aside
            sample = replace(sample, tracking_state=states, positions=positions)
        changed.append(sample)
    return changed


@pytest.fixture(scope="module")
def both_cameras(session):
    _, _, skeletons, imus = session
    return run(merged(skeletons, imus))


def test_weights_are_those_of_the_paper_and_axial_rotation_comes_from_the_imu(both_cameras):
    pipeline, estimates = both_cameras
    last = estimates[-1]
    assert any(use.is_aligned for use in pipeline.imu_uses)
    assert last.weight_kinect[KNEE] == pytest.approx(0.8)
    assert last.weight_imu[KNEE] == pytest.approx(0.2)
    assert last.source[KNEE] == Source.FUSED
    assert last.source[MODEL.dof_index["left_hip_rotation"]] == Source.IMU


@pytest.mark.parametrize("state", [TrackingState.INFERRED, TrackingState.NOT_TRACKED])
def test_an_occluded_limb_uses_only_its_imu_until_it_is_tracked_again(state, session):
    t, dof, skeletons, imus = session
    _, estimates = run(merged(with_foot(skeletons, state, aside=0.3), imus))
    hidden = [e for e in estimates if e.stamp_ns > HIDDEN_FROM_NS]
    assert all((e.weight_kinect[KNEE], e.weight_imu[KNEE]) == (0.0, 1.0) for e in hidden)
    errors = [np.degrees(e.position[KNEE] - truth_at(e, t, dof)[KNEE]) for e in hidden]
    assert np.sqrt(np.mean(np.square(errors))) < 12.0  # the Kinect's own would be 30 and more


def test_zhang2015_uses_only_the_first_sensor(session, both_cameras):
    _, _, skeletons, imus = session
    _, both = both_cameras
    _, left = run(merged([s for s in skeletons if s.sensor == "left"], imus))
    frames = {s.stamp_ns for s in skeletons if s.sensor == "left"}
    assert {e.stamp_ns for e in both} <= frames
    assert {e.stamp_ns for e in left} <= frames


def test_zhang2015_tells_imus_that_do_not_fit_from_those_that_do_not_move():
    _, _, skeletons, imus = moving_wearer(30.0)
    first = {sample.segment: sample for sample in reversed(imus)}
    exchanged = {"left_shank": "left_forearm", "left_forearm": "left_shank"}
    imus = [
        replace(first["torso"], stamp_ns=sample.stamp_ns)
        if sample.segment == "torso"
        else replace(sample, segment=exchanged.get(sample.segment, sample.segment))
        for sample in imus
    ]
    pipeline, _ = run(merged(skeletons, imus))
    reasons = {use.segment: use.reason for use in pipeline.imu_uses}
    assert "it has not turned by 8° yet" in reasons["torso"]
    assert "does not fit this segment" in reasons["left_shank"]
    assert not reasons["left_thigh"]


def test_li2020_reports_every_imu_as_unused(session):
    _, _, skeletons, imus = session
    pipeline, _ = run(merged(skeletons[:200], imus[:500]), "li2020")
    assert pipeline.imu_uses
    assert all("li2020 uses no IMUs" in use.reason for use in pipeline.imu_uses)
