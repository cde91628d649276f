"""The joints as the sensors give them."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX


@pytest.mark.parametrize(("estimator", "is_seen"), [("mean", True), ("left", False)])
def test_a_joint_that_only_the_other_sensor_sees_is_not_called_tracked(estimator, is_seen):
    joint = JOINT_INDEX["left_hand"]
    _, dof = motion(5.0)
    rng = np.random.default_rng(5)
    samples = skeleton_samples(kinematics().pose(dof).positions, extrinsics(), rng, 0.0)
    hidden = []
    for sample in samples:
        positions, state = sample.positions.copy(), sample.tracking_state.copy()
        if sample.sensor == "left":
            positions[joint], state[joint] = np.nan, 0
        hidden.append(replace(sample, positions=positions, tracking_state=state))
    pipeline = Pipeline(PipelineParameters(estimator=estimator), extrinsics())
    estimates = [each for one in hidden for each in pipeline.add(one)] + pipeline.flush()
    last = estimates[-1]
    assert bool(np.isfinite(last.joints[joint]).all()) == is_seen
    assert bool(last.tracking_state[joint]) == is_seen
