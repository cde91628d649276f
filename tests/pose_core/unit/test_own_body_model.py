"""Body models of the user's own: honoured, or refused in one line."""

from importlib import resources

import numpy as np
import pytest
import yaml

from pose_core.api import InputError, PipelineParameters, body_model_of, load_body_model
from pose_core.body.joint_rotations import link_angles
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import ROOT_DOF, available_models

DEFAULT = resources.files("pose_core.body") / "body_models" / "default.yaml"


def written(tmp_path, change):
    document = yaml.safe_load(DEFAULT.read_text())
    document["name"] = "own"
    change(document)
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False))
    return str(path)


def add_neck_rotation(document):
    document["links"]["head"]["dof"].append(["neck_rotation", [0, 0, 1], -80, 80])
    document["order"].append("neck_rotation")


def test_a_file_is_named_by_its_path(tmp_path):
    path = written(tmp_path, add_neck_rotation)
    model = body_model_of(PipelineParameters(body_model=path))
    assert model.name == "own"
    assert model.angle_names[-1] == "neck_rotation"


def test_added_angles_are_extracted_consistently_with_forward_kinematics(tmp_path):
    model = load_body_model(written(tmp_path, add_neck_rotation))
    angles = np.array([0.4, -0.3, 0.7])
    dof = np.zeros(model.size)
    names = ("neck_flexion", "neck_lateral_bending", "neck_rotation")
    dof[[model.dof_index[name] for name in names]] = angles
    R = ForwardKinematics(model, np.zeros((15, 3))).pose(dof).rotations
    head, trunk = (model.link_names.index(name) for name in ("head", "trunk"))
    found = link_angles(model.links["head"], R[trunk].T @ R[head], np.zeros(3))
    np.testing.assert_allclose(found, angles, atol=1e-12)


@pytest.mark.parametrize("name", available_models())
def test_angles_of_every_bundled_model_are_extracted_consistently_with_forward_kinematics(name):
    model = load_body_model(name)
    lower, upper = model.limits.T
    rng = np.random.default_rng(7)
    dof = np.zeros(model.size)
    dof[ROOT_DOF:] = rng.uniform(np.maximum(lower, 0.0), np.minimum(upper, 1.0))
    R = ForwardKinematics(model, np.zeros((15, 3))).pose(dof).rotations
    for link in model.links.values():
        if link.parent is None:
            continue
        own, parent = (model.link_names.index(each) for each in (link.name, link.parent))
        which = [model.dof_index[each.name] for each in link.dof]
        found = link_angles(link, R[parent].T @ R[own], np.zeros(len(which)))
        np.testing.assert_allclose(found, dof[which], atol=1e-9, err_msg=link.name)


def other_axis(document):
    document["links"]["left_forearm"]["dof"][0][1] = [0, 0, 1]


def other_order(document):
    document["links"]["left_thigh"]["dof"].reverse()


def other_link(document):
    document["links"]["tail"] = {"parent": "pelvis", "joint": "torso", "dof": []}


def crossed_limits(document):
    document["links"]["left_shank"]["dof"][0][2:] = [160, -10]


def other_bone(document):
    document["joints"]["left_knee"]["direction"] = [1, 0, 0]


def no_joints(document):
    del document["joints"]


def other_sides_joint(document):
    document["links"]["left_thigh"]["joint"] = "right_hip"


def other_sides_angle(document):
    document["links"]["left_shank"]["dof"][0][0] = "right_knee_flexion"


def other_parent(document):
    document["links"]["left_upper_arm"]["parent"] = "pelvis"


def link_before_its_parent(document):
    document["links"] = dict(reversed(document["links"].items()))


def bone_upwards(document):
    document["joints"]["left_elbow"]["direction"] = [0, 0, 1]


def measured_bone(document):
    document["joints"]["left_elbow"]["direction"] = "measured"


def more_than_a_turn(document):
    document["links"]["left_shank"]["dof"][0][2:] = [-400, 720]


def other_limbs_segment(document):
    document["segments"]["left_forearm"] = "left_shank"


def misspelt_section(document):
    document["slidng"] = document.pop("sliding")


def unknown_field_of_a_link(document):
    document["links"]["left_shank"]["inertia"] = 3


def unknown_field_of_a_joint(document):
    document["joints"]["left_foot"]["length"] = 0.4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (other_axis, r"turns by .*'left_elbow_flexion', \(0, 0, 1\).*: expected .*\(0, -1, 0\)"),
        (other_order, r"'left_thigh' turns by .*left_hip_rotation.*: expected .*left_hip_flexion"),
        (other_link, r"links \['tail'\]: expected exactly pelvis, trunk"),
        (crossed_limits, "left_knee_flexion is limited to 160 to -10 degrees"),
        (more_than_a_turn, "left_knee_flexion is limited to -400 to 720 degrees"),
        (other_bone, r"the bone to left_knee points along \(1, 0, 0\): expected \(0, 0, -1\)"),
        (bone_upwards, r"the bone to left_elbow points along \(0, 0, 1\): expected \(0, 0, -1\)"),
        (measured_bone, r"the bone to left_elbow points along measured: expected \(0, 0, -1\)"),
        (no_joints, "lacks a field"),
        (other_sides_joint, "'left_thigh' hangs on right_hip: expected left_hip"),
        (other_sides_angle, r"'left_shank' turns by .*right_knee_.*: expected .*left_knee_"),
        (other_parent, "'left_upper_arm' has parent pelvis: expected trunk"),
        (link_before_its_parent, "'right_shank' comes before right_thigh: expected parents first"),
        (other_limbs_segment, "segment 'left_forearm' on link 'left_shank'"),
        (misspelt_section, "'own' has slidng: expected some of name, .*sliding"),
        (unknown_field_of_a_link, "link 'left_shank' has inertia: expected some of parent"),
        (unknown_field_of_a_joint, "joint 'left_foot' has length: expected some of link"),
        (lambda document: document.update(name="default"), "named 'default' as a bundled one"),
    ],
)
def test_an_unsupported_body_model_is_refused(tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        load_body_model(written(tmp_path, change))


def test_a_file_that_is_not_there_is_refused():
    with pytest.raises(InputError, match=r"found no body model 'nowhere\.yaml'"):
        load_body_model("nowhere.yaml")
