from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, SHAPE, kinematics, random_dof

from pose_core.body.model import ROOT_DOF
from pose_core.body.urdf import make_urdf
from pose_core.joints import JOINT_INDEX


def vector(text):
    return np.array([float(value) for value in text.split()])


def link_places(robot, angles):
    """Walk the tree as any reader of URDF does: T_body_link of every link."""
    places = {"body_me": np.eye(4)}
    for joint in robot.iter("joint"):
        T = np.eye(4)
        T[:3, 3] = vector(joint.find("origin").get("xyz"))
        if joint.get("type") == "revolute":
            axis = vector(joint.find("axis").get("xyz"))
            T[:3, :3] = Rotation.from_rotvec(axis * angles[joint.get("name")]).as_matrix()
        parent, child = joint.find("parent").get("link"), joint.find("child").get("link")
        places[child] = places[parent] @ T
    return places


def test_the_tree_has_one_revolute_joint_for_each_joint_angle():
    robot = ElementTree.fromstring(make_urdf(MODEL, SHAPE, "me"))
    moving = [j.get("name") for j in robot.iter("joint") if j.get("type") != "fixed"]
    assert sorted(moving) == sorted(MODEL.angle_names)
    assert {j.get("type") for j in robot.iter("joint")} == {"revolute", "fixed"}


def test_forward_kinematics_of_the_urdf_equals_the_models():
    robot = ElementTree.fromstring(make_urdf(MODEL, SHAPE, "me"))
    for dof in random_dof(np.random.default_rng(30), 10):
        dof[:ROOT_DOF] = 0.0
        pose = kinematics().pose(dof)
        places = link_places(robot, dict(zip(MODEL.angle_names, dof[ROOT_DOF:], strict=True)))
        for joint, place in MODEL.joints.items():
            link = MODEL.links[place.link]
            frame = "body_me" if link.parent is None else f"{link.name}_me"
            offset = np.append(SHAPE.offsets[JOINT_INDEX[joint]], 1.0)
            np.testing.assert_allclose(
                (places[frame] @ offset)[:3], pose.positions[JOINT_INDEX[joint]], atol=1e-4
            )


def test_drawn_bones_point_from_the_link_to_its_joints():
    robot = ElementTree.fromstring(make_urdf(MODEL, SHAPE, "me"))
    thigh = next(link for link in robot.iter("link") if link.get("name") == "left_thigh_me")
    origin = thigh.find("visual/origin")
    roll, pitch, yaw = vector(origin.get("rpy"))
    axis = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix()[:, 2]
    np.testing.assert_allclose(np.abs(axis), [0.0, 0.0, 1.0], atol=1e-4)
    np.testing.assert_allclose(vector(origin.get("xyz")), [0.0, 0.0, -0.21], atol=1e-4)
