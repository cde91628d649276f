"""Errors of a view along its rays: what the filter learns of them, and what they do to the pose."""

import numpy as np
import pytest

from pose_core.body.average_body import neutral_pose
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import load_body_model
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import shape_of
from pose_core.filter.constants import make_constants
from pose_core.filter.depth_errors import depth_variance_scale
from pose_core.filter.frame import CameraFrame
from pose_core.filter.layout import make_layout
from pose_core.filter.motion import predict
from pose_core.filter.state import start_state
from pose_core.filter.step import update_with_frame
from pose_core.filter.tuning import FilterTuning

MODEL = load_body_model("default")
SHAPE = shape_of(MODEL, neutral_pose())
TREE = SegmentTree(MODEL, SHAPE)
CONSTANTS = make_constants(TREE, FilterTuning())
LINKS = len(TREE.parents)
STANDING = ForwardKinematics(MODEL, SHAPE.offsets).pose(np.zeros(MODEL.size))
CAMERAS = np.array([[3.0, 0.5, 1.2], [0.5, 3.0, 1.2]])
ROOT = STANDING.positions[np.argmin(np.linalg.norm(TREE.offsets[:, 0], axis=1))]
TRACKED = np.full(15, 2, np.uint8)


@pytest.fixture
def state():
    layout = make_layout(LINKS, len(TREE.sliding_links))
    slides = CONSTANTS.motion.slide_variance
    return start_state(layout, 2, FilterTuning(), slides, ROOT, STANDING.rotations)


def watch(state, error, seconds):
    """Two cameras see somebody stand for a time, the first one with an error along its rays.

    Args:
        state: The filter's state.
        error: Function of the time [s]: errors along the rays, one or (15,) [m].
        seconds: The time [s].

    Returns:
        Largest distance [m] of the pelvis from where it is, in the second half.
    """
    farthest = 0.0
    for step in range(int(60 * seconds)):
        predict(CONSTANTS.motion, state, 1.0 / 60.0)
        sensor = step % 2
        joints = STANDING.positions.copy()
        if sensor == 0:
            rays = joints - CAMERAS[0]
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            joints += rays * np.reshape(error(step / 60.0), (-1, 1))
        frame = CameraFrame(sensor, joints, TRACKED, CAMERAS[sensor].copy())
        assert update_with_frame(CONSTANTS, state, frame, np.zeros((LINKS, 3, 3)))[0]
        if step > 30 * seconds:
            farthest = max(farthest, np.linalg.norm(state.pose.position - ROOT))
    return farthest


def test_a_view_whose_distance_wobbles_hardly_moves_the_person(state):
    farthest = watch(state, lambda t: 0.2 * np.sin(2.0 * np.pi * 0.7 * t), 20.0)

    assert farthest < 0.11  # 0.23 m if the view is believed
    assert np.sqrt(state.views.depth_error_power) == pytest.approx([0.14, 0.0], abs=0.03)


def test_noise_along_the_rays_is_learnt_of_the_view_that_has_it(state):
    rng = np.random.default_rng(4)

    watch(state, lambda _: rng.normal(scale=0.1, size=15), 20.0)

    assert np.sqrt(state.views.depth_noise[0]) == pytest.approx(0.1, abs=0.02)
    assert np.sqrt(state.views.depth_noise[1]) < 0.02


def test_of_views_without_errors_nothing_is_learnt(state):
    watch(state, lambda _: 0.0, 20.0)

    assert np.sqrt(state.views.depth_error_power).max() < 0.01
    assert np.sqrt(state.views.depth_noise).max() < 0.01


@pytest.mark.parametrize(
    ("shared", "noise", "scale"), [(0.015, 0.02, 1.0), (0.06, 0.03, 2.4), (0.4, 0.06, 3.9)]
)
def test_errors_along_the_rays_enlarge_the_published_variances(shared, noise, scale):
    found = depth_variance_scale(np.full(2, shared**2), np.full(2, noise**2))
    assert found == pytest.approx(scale, abs=0.1)
