"""SMPL's joints from the person's frames."""

import numpy as np
from scipy.spatial.transform import Rotation
from sent_frames import sent_frames

from pose_core.joints import JOINT_INDEX
from pose_io.recordings.joint_map_files import find_joint_map
from pose_teleop.retargeting import SMPL, smpl_poses


def poses_of(in_body=False, **options):
    names, position, xyzw, joints = sent_frames(**options)
    return smpl_poses(names, position, xyzw, "subject", in_body), joints


def test_the_order_is_that_of_the_map_that_the_bridge_reads():
    assert list(SMPL) == list(find_joint_map("smpl_24").joints)


def test_what_the_bridge_makes_of_the_poses_are_the_joints():
    angles = {"left_shoulder_flexion": 1.0, "right_knee_flexion": 0.7, "waist_rotation": 0.4}
    poses, joints = poses_of(angles=angles, turn=0.8)

    found, _ = find_joint_map("smpl_24").convert(poses.position, np.full(24, 2, np.uint8))

    for name in ("left_hand", "right_foot", "left_elbow", "right_hip", "torso"):
        x, y, z = joints[JOINT_INDEX[name]]
        np.testing.assert_allclose(found[JOINT_INDEX[name]], [-y, -z, x], atol=1e-6)  # optical


def test_in_the_n_pose_all_segments_are_turned_as_the_person():
    poses, _ = poses_of(turn=0.5)

    turned = Rotation.from_quat(poses.xyzw).as_rotvec()
    np.testing.assert_allclose(turned, np.tile([0.0, 0.0, 0.5], (24, 1)), atol=1e-6)


def test_in_the_persons_own_frame_the_pelvis_is_the_origin():
    poses, _ = poses_of(in_body=True, turn=0.5)

    np.testing.assert_allclose(poses.position[0], 0.0, atol=1e-9)
    assert poses.position[SMPL.index("left_hip"), 1] > 0.05


def test_joints_that_are_not_measured_are_marked_as_not_valid():
    poses, _ = poses_of()

    guesses = {name for name, valid in zip(SMPL, poses.is_valid, strict=True) if not valid}
    assert guesses == {
        *("spine1", "spine3", "left_collar", "right_collar"),
        *("left_hand", "right_hand", "left_foot", "right_foot"),
    }


def test_without_a_frame_there_is_no_pose():
    names, position, xyzw, _ = sent_frames()

    assert smpl_poses(names[:-1], position[:-1], xyzw[:-1], "subject", False) is None
