"""The compiled filter gives what the plain one gives."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_bench.reference.segment_filter import ReferenceFilter
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import load_body_model
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import BodyShape
from pose_core.filters.looks import CameraLooks, LinkLooks
from pose_core.filters.segment_filter import NO_IMUS, SegmentFilter
from pose_core.kernels import camera, inverse, links, placing, posture, prediction

MODEL = load_body_model("default")
STATE = ("position", "rotations", "slides", "velocity", "rates", "covariance")


def pose(dof):
    kinematics = ForwardKinematics(MODEL, OFFSETS, np.eye(3))
    return kinematics.pose(dof)


OFFSETS = np.random.default_rng(5).normal(0.0, 0.25, (15, 3))


def camera_looks(rng, joints, delay_s):
    positions = joints + rng.normal(0.0, 0.03, (2, *joints.shape))
    state = rng.choice([0, 1, 2], size=(2, 15), p=[0.1, 0.2, 0.7]).astype(np.uint8)
    positions[rng.random((2, 15)) < 0.1] = np.nan
    return CameraLooks(
        positions=positions,
        tracking_state=state,
        cameras=np.stack([np.array([3.0, rng.normal(), 1.2]) for _ in range(2)]),
        offsets=rng.normal(0.0, 0.02, (2, 15, 3)),
        delay_s=delay_s,
    )


def link_looks(rng, rotations):
    noise = Rotation.from_rotvec(rng.normal(0.0, 0.05, (len(rotations), 3))).as_matrix()
    links = np.arange(9)
    return LinkLooks(
        links=links,
        R_map_link=(noise @ rotations)[links],
        variance=rng.uniform(0.01, 0.1, (9, 3)),
        angular_velocity=rng.normal(0.0, 1.0, (9, 3)),
        rate_variance=np.full(9, 0.0025),
    )


def run_both(seed, steps, with_imus, delay_s):
    """The states of both filters after the same looks."""
    rng = np.random.default_rng(seed)
    tree = SegmentTree(MODEL, BodyShape(offsets=OFFSETS))
    filters = SegmentFilter(tree), ReferenceFilter(tree)
    dof = rng.normal(0.0, 0.3, MODEL.size)
    start = pose(dof)
    for each in filters:
        each.start(start.rotations, dof[:3])
    for _ in range(steps):
        dof = dof + rng.normal(0.0, 0.05, MODEL.size)
        truth = pose(dof)
        cameras = camera_looks(rng, truth.positions, delay_s)
        imus = link_looks(rng, truth.rotations) if with_imus else NO_IMUS
        dt_s = rng.uniform(0.001, 0.05)
        reports = []
        for each in filters:
            each.predict(dt_s)
            reports.append(each.update(cameras, imus))
    return filters, reports


@pytest.mark.parametrize("with_imus", [False, True])
@pytest.mark.parametrize("delay_s", [0.0, 0.06])
def test_the_compiled_filter_equals_the_plain_one(with_imus, delay_s):
    (fast, plain), (report, expected) = run_both(3, 12, with_imus, delay_s)
    for name in STATE:
        np.testing.assert_allclose(
            getattr(fast.state, name), getattr(plain.state, name), rtol=0.0, atol=1e-9
        )
    np.testing.assert_allclose(fast.joints(), plain.joints(), atol=1e-9)
    np.testing.assert_allclose(report.distance, expected.distance, rtol=1e-7)
    np.testing.assert_allclose(report.information, expected.information, rtol=1e-7, atol=1e-6)
    assert report.outcome == pytest.approx(expected.outcome, rel=1e-7)


def test_a_covariance_that_is_no_longer_positive_is_an_error():
    (fast, _), _ = run_both(4, 1, False, 0.0)
    fast.state.covariance[:] = -np.eye(fast.layout.size)
    with pytest.raises(np.linalg.LinAlgError):
        fast.update()


def test_no_kernel_is_compiled_twice():
    run_both(5, 2, True, 0.06)
    kernels = (
        camera.add_camera,
        links.add_imus,
        inverse.invert,
        links.turn_back,
        placing.place_joints,
        posture.add_posture,
        prediction.predict_covariance,
        prediction.predict_pose,
        prediction.remember,
    )
    assert {k.py_func.__name__: len(k.signatures) for k in kernels if len(k.signatures) > 1} == {}
