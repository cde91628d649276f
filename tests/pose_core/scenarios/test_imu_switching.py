"""Kinect and IMU take over from each other, and nothing shows (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from synthetic_body import MODEL, extrinsics
from worn_imus import START_NS, merged, moving_wearer, truth_at

from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pipeline import FusionPipeline
from pose_core.joints import JOINT_INDEX, TrackingState

DURATION_S = 27.0
HIDDEN_S = (24.0, 25.2)
LARGEST_STEP_DEG = 3.0
FOOT = JOINT_INDEX["left_foot"]


def run(samples, **parameters):
    parameters = FusionParameters(**parameters)
    return fused(FusionPipeline(parameters, extrinsics()), samples)


@pytest.fixture(scope="module")
def session():
    return moving_wearer(DURATION_S)


def hidden(skeletons, change):
    """The skeletons, those in the hidden stretch changed."""
    first, last = (START_NS + round(s * 1e9) for s in HIDDEN_S)
    changed = [change(s) if first < s.stamp_ns < last else s for s in skeletons]
    return [s for s in changed if s is not None]


def foot_elsewhere(sample, state):
    positions, states = sample.positions.copy(), sample.tracking_state.copy()
    positions[FOOT] += np.array([0.25, 0.1, 0.0])
    states[FOOT] = state
    return replace(sample, positions=positions, tracking_state=states)


def steps_deg(estimates, t, dof, name):
    """What an angle does from one estimate to the next beyond the motion [deg], from 21 s on."""
    index = MODEL.dof_index[name]
    late = [e for e in estimates if e.stamp_ns > START_NS + 21 * 10**9]
    truth = np.array([truth_at(e, t, dof)[index] for e in late])
    found = np.array([e.position[e.dof_names.index(name)] for e in late])
    return np.degrees(np.abs(np.diff(found - truth))), np.degrees(found - truth), late


@pytest.mark.parametrize("weighting", ["variance", "zhang2015"])
@pytest.mark.parametrize("state", [TrackingState.INFERRED, TrackingState.TRACKED])
def test_a_joint_that_jumps_aside_makes_no_step(weighting, state, session):
    """Whether the tracker admits it, or calls the joint tracked."""
    t, dof, skeletons, imus = session
    samples = merged(hidden(skeletons, lambda s: foot_elsewhere(s, state)), imus)
    estimates = run(samples, estimator="li2020", imu_weighting=weighting)
    steps, errors, late = steps_deg(estimates, t, dof, "left_knee_flexion")
    assert steps.max() < LARGEST_STEP_DEG
    in_the_midst = [START_NS + 24.5e9 < e.stamp_ns < START_NS + 25.2e9 for e in late]
    assert np.abs(errors[in_the_midst]).max() < 16.0  # the wrong foot alone is 34 off


def test_a_switch_between_sources_that_differ_makes_no_step(session):
    """The Kinects see the foot 15 degrees beside its place, and call it hidden for a while."""
    t, dof, skeletons, imus = session

    def beside(sample):
        positions = sample.positions.copy()
        positions[FOOT] += np.array([0.1, 0.0, 0.0])
        return replace(sample, positions=positions)

    def called_hidden(sample):
        states = sample.tracking_state.copy()
        states[FOOT] = TrackingState.INFERRED
        return replace(sample, tracking_state=states)

    beside_from_ns = START_NS + 20 * 10**9
    skeletons = [beside(s) if s.stamp_ns > beside_from_ns else s for s in skeletons]
    estimates = run(
        merged(hidden(skeletons, called_hidden), imus),
        estimator="li2020",
        imu_weighting="zhang2015",
    )
    steps, errors, _ = steps_deg(estimates, t, dof, "left_knee_flexion")
    assert np.ptp(errors) > 5.0  # there is something to switch between
    assert steps.max() < LARGEST_STEP_DEG


@pytest.mark.parametrize("name", ["default", "imu"])
def test_cameras_that_take_over_again_make_no_step(name, session):
    t, dof, skeletons, imus = session
    samples = merged(hidden(skeletons, lambda s: None), imus)
    estimates = run(samples, estimator=name)
    alone = [e for e in estimates if START_NS + 24.2e9 < e.stamp_ns < START_NS + 25.2e9]
    assert len(alone) > 15  # the IMUs alone go on
    for angle in ("left_knee_flexion", "left_elbow_flexion", "left_hip_flexion"):
        steps, _, _ = steps_deg(estimates, t, dof, angle)
        assert steps.max() < LARGEST_STEP_DEG
