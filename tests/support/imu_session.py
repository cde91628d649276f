"""The synthetic body with an IMU on every segment: a session, and the errors of angles in it."""

import numpy as np
from fusing import fused
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import EVERY_SEGMENT, START_NS, imu_samples, merged, truth_at

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline


def imu_session(duration_s):
    """Times, degrees of freedom, skeletons and IMU samples of a body that leans."""
    t, dof = motion(duration_s, lean=0.3)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.02)
    return t, dof, skeletons, imu_samples(t, dof, np.random.default_rng(5), segments=EVERY_SEGMENT)


def uses_and_spread(session, imus, angles, judged_s):
    """Uses of the IMUs by segment, and the spread of angles' errors from an instant on [deg]."""
    t, dof, skeletons, _ = session
    pipeline = Pipeline(PipelineParameters(), extrinsics())
    errors = [
        e.position[e.dof_names.index(name)] - truth_at(e, t, dof)[MODEL.dof_index[name]]
        for e in fused(pipeline, merged(skeletons, imus))
        if e.stamp_ns > START_NS + judged_s * 1e9
        for name in angles
    ]
    return {use.segment: use for use in pipeline.imu_uses}, np.degrees(np.std(errors))
