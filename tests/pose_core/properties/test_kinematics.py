import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, SHAPE, kinematics, random_dof

from pose_core.body.inverse_kinematics import dof_from_positions, vector_from_rotation
from pose_core.body.joint_angles import joint_angles
from pose_core.body.joint_rotations import continuous_vector, link_angles
from pose_core.body.kinematics import left_jacobian
from pose_core.body.trunk import trunk_axes
from pose_core.joints import JOINT_INDEX


@pytest.fixture
def rng():
    return np.random.default_rng(20)


@pytest.mark.parametrize("scale", [0.0, 1e-7, 0.5, 2.5])
def test_left_jacobian_is_the_derivative_of_the_exponential(rng, scale):
    v, delta = scale * rng.normal(size=3), 1e-6 * rng.normal(size=3)
    moved = Rotation.from_rotvec(v + delta) * Rotation.from_rotvec(v).inv()
    np.testing.assert_allclose(left_jacobian(v) @ delta, moved.as_rotvec(), atol=1e-11)


def test_bone_lengths_are_the_same_in_every_pose(rng):
    positions = kinematics().pose(random_dof(rng, 30)).positions
    for joint, place in MODEL.joints.items():
        start = MODEL.links[place.link].joint
        if start is None:
            continue
        bone = positions[:, JOINT_INDEX[joint]] - positions[:, JOINT_INDEX[start]]
        length = np.linalg.norm(SHAPE.offsets[JOINT_INDEX[joint]])
        np.testing.assert_allclose(np.linalg.norm(bone, axis=1), length, rtol=1e-12)


def test_a_batch_of_poses_equals_single_poses(rng):
    body, dof = kinematics(), random_dof(rng, 7)
    together = body.pose(dof)
    for index, one in enumerate(dof):
        alone = body.pose(one)
        np.testing.assert_allclose(alone.positions, together.positions[index], atol=1e-14)
        np.testing.assert_allclose(alone.rotations, together.rotations[index], atol=1e-14)


def test_inverse_kinematics_inverts_forward_kinematics(rng):
    body = kinematics()
    for dof in random_dof(rng, 30):
        body.R_reference = np.eye(3)
        positions = body.pose(dof).positions
        found = dof_from_positions(MODEL, positions)
        found[3:6] = vector_from_rotation(trunk_axes(positions))
        np.testing.assert_allclose(found, dof, atol=1e-9)


def test_model_angles_equal_joint_angles_of_the_positions(rng):
    dof = random_dof(rng, 20)
    measured = joint_angles(kinematics().pose(dof).positions)
    for name, values in measured.items():
        np.testing.assert_allclose(values, dof[:, MODEL.dof_index[name]], atol=1e-9, err_msg=name)


def test_link_angles_invert_the_rotation_chain_of_a_link(rng):
    body = kinematics()
    for dof in random_dof(rng, 20):
        rotations = body.pose(dof).rotations
        for index, link in enumerate(MODEL.links.values()):
            if link.parent is None:
                continue
            which = [MODEL.dof_index[d.name] for d in link.dof]
            parent = rotations[MODEL.link_names.index(link.parent)]
            found = link_angles(link, parent.T @ rotations[index], dof[which])
            np.testing.assert_allclose(found, dof[which], atol=1e-9, err_msg=link.name)


def test_shoulder_angles_are_continuous_through_the_singularity():
    link = MODEL.links["left_upper_arm"]
    previous = np.zeros(3)
    body = kinematics()
    dof = np.zeros(MODEL.size)
    for abduction in np.radians(np.arange(0.0, 170.0, 2.0)):
        dof[MODEL.dof_index["left_shoulder_abduction"]] = abduction
        dof[MODEL.dof_index["left_shoulder_flexion"]] = 0.05
        R = body.pose(dof).rotations[MODEL.link_names.index(link.name)]
        angles = link_angles(link, R, previous)
        assert np.max(np.abs(angles - previous)) < 0.3
        previous = angles
    assert previous[1] > np.radians(150.0)


def test_a_rotation_vector_is_continuous_beyond_half_a_turn(rng):
    axis = np.array([0.1, -0.2, 0.9]) / np.linalg.norm([0.1, -0.2, 0.9])
    previous = np.zeros(3)
    for angle in np.arange(0.0, 15.0, 0.1):
        vector = Rotation.from_rotvec(angle * axis).as_rotvec()
        previous = continuous_vector(vector, previous)
        np.testing.assert_allclose(previous, angle * axis, atol=1e-9)


def test_shoulder_angles_return_into_their_limits_after_an_outlier():
    link, body = MODEL.links["left_upper_arm"], kinematics()
    which = [MODEL.dof_index[dof.name] for dof in link.dof]
    true, dof = np.radians([20.0, 15.0, 5.0]), np.zeros(MODEL.size)
    other_way = np.array([true[0] - np.pi, np.pi - true[1], true[2] + np.pi])
    dof[which] = true
    R = body.pose(dof).rotations[MODEL.link_names.index(link.name)]
    np.testing.assert_allclose(link_angles(link, R, other_way), true, atol=1e-9)
    dof[which] = other_way  # the same pose
    same = body.pose(dof).rotations[MODEL.link_names.index(link.name)]
    np.testing.assert_allclose(same, R, atol=1e-9)
