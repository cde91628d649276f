import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.body.joint_angles import ANGLES, joint_angles
from pose_core.joints import JOINT_INDEX


@pytest.fixture
def skeletons():
    return np.random.default_rng(3).normal(size=(200, 15, 3))


def mirrored(positions):
    """Seen in a mirror, with the names of the sides exchanged as a mirror does."""
    swapped = positions * np.array([1.0, -1.0, 1.0])
    order = list(range(15))
    for name, index in JOINT_INDEX.items():
        if name.startswith("left_"):
            other = JOINT_INDEX[name.replace("left_", "right_")]
            order[index], order[other] = other, index
    return swapped[:, order]


def test_a_mirrored_skeleton_has_left_and_right_exchanged(skeletons):
    straight, mirror = joint_angles(skeletons), joint_angles(mirrored(skeletons))
    for name in ANGLES:
        other = name.replace("left_", "R_").replace("right_", "left_").replace("R_", "right_")
        np.testing.assert_allclose(mirror[name], straight[other], atol=1e-9)


def test_joint_angles_are_invariant_to_rigid_motion(skeletons):
    turn = Rotation.random(random_state=5).as_matrix()
    moved = joint_angles(skeletons @ turn.T + np.array([3.0, -2.0, 1.0]))
    for name, angle in joint_angles(skeletons).items():
        np.testing.assert_allclose(moved[name], angle, atol=1e-9)


def test_joint_angles_are_invariant_to_scale(skeletons):
    scaled = joint_angles(1.7 * skeletons)
    for name, angle in joint_angles(skeletons).items():
        np.testing.assert_allclose(scaled[name], angle, atol=1e-9)


def test_each_frame_is_computed_independently(skeletons):
    whole = joint_angles(skeletons)
    for name, angle in joint_angles(skeletons[17:18]).items():
        np.testing.assert_allclose(angle[0], whole[name][17])
