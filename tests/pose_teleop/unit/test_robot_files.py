"""Robots by name or file, and errors of invalid ones."""

import numpy as np
import pytest
import yaml

from pose_core.errors import InputError
from pose_teleop import extras
from pose_teleop.arm_mapping import JointMapping
from pose_teleop.robot_arm import RobotArm
from pose_teleop.robot_files import load_robot, shipped_robots

pytest.importorskip("pinocchio")

TWO_JOINTS = """<robot name="two">
<link name="base"/><link name="upper"/><link name="fore"/><link name="tip"/>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="2" velocity="3" effort="10"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="fore"/><axis xyz="0 1 0"/>
<origin xyz="0 0 -0.3"/><limit lower="-2" upper="1" velocity="4" effort="10"/></joint>
<joint name="c" type="fixed"><parent link="fore"/><child link="tip"/>
<origin xyz="0 0 -0.2"/></joint>
</robot>"""


def robot_file(folder, **changes):
    (folder / "two.urdf").write_text(TWO_JOINTS)
    content = {
        "urdf": str(folder / "two.urdf"),
        "joints": ["a", "b"],
        "shoulder": "upper",
        "elbow": "fore",
        "tool": "tip",
        "rest": [0.1, -0.2],
        "map": {"a": {"of": "shoulder_flexion", "scale": -1}},
        **changes,
    }
    path = folder / "two.yaml"
    path.write_text(yaml.safe_dump({k: v for k, v in content.items() if v is not None}))
    return str(path)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("name", shipped_robots())
def test_every_shipped_robot_loads_for_both_sides(name, side):
    arm = RobotArm(load_robot(name, side))

    assert (arm.lower < arm.upper).all()
    assert (arm.max_velocity > 0.0).all()
    assert min(arm.segments) > 0.05


def test_a_robot_of_the_users_is_read_from_its_file(tmp_path):
    arm = RobotArm(load_robot(robot_file(tmp_path), "left"))

    assert arm.joints == ("a", "b")
    np.testing.assert_allclose(arm.max_velocity, [3.0, 4.0])
    np.testing.assert_allclose(arm.segments, [0.3, 0.2])
    target = JointMapping(arm).target(np.array([0.5, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(target, [-0.5, -0.2])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joints": ["a", "z"]}, "no joint 'z'"),
        ({"tool": "nowhere"}, "no link 'nowhere'"),
        ({"urdf": "missing.urdf"}, "found no robot description"),
        ({"urdf": "package://nobody/x.urdf"}, "of the package 'nobody'"),
        ({"shoulder": None}, "lacks shoulder"),
        ({"rest": "none"}, "is not as robots/g1.yaml"),
    ],
)
def test_a_file_that_is_none_is_refused_with_what_is_wrong(tmp_path, changes, said):
    with pytest.raises(InputError, match=said):
        RobotArm(load_robot(robot_file(tmp_path, **changes), "left"))


def test_a_map_with_an_unknown_angle_is_refused(tmp_path):
    arm = RobotArm(load_robot(robot_file(tmp_path, map={"a": {"of": "knee_flexion"}}), "left"))

    with pytest.raises(InputError, match="unknown knee_flexion"):
        JointMapping(arm)


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="expected one of g1, panda"):
        load_robot("r2d2", "left")


def test_what_is_not_installed_is_named_with_the_line_that_installs_it():
    with pytest.raises(InputError, match=r"'nothing_like_it'.*--teleop"):
        extras.require("nothing_like_it")
