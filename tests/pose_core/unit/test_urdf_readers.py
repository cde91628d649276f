"""URDF and JointState through another kinematics library, and bags through another reader."""

from xml.etree import ElementTree

import numpy as np
import pinocchio
import pytest
from exported_motion import body_models, moving, shape_of, write_motion_bag
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import ROOT_DOF
from pose_core.body.urdf import joint_frame, make_urdf
from pose_core.joints import JOINT_INDEX

MODELS = body_models()
MM = 1e-3


@pytest.fixture(scope="module", params=MODELS, ids=[model.name for model in MODELS])
def decoded(request, tmp_path_factory):
    """Messages of a fused bag by topic, decoded by the definitions in the file alone."""
    path = tmp_path_factory.mktemp("bag") / "bag"
    write_motion_bag(path, request.param, 5)
    messages = {}
    with next(path.glob("*.mcap")).open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, _, message in reader.iter_decoded_messages():
            assert schema.encoding == "ros2msg"
            messages.setdefault(channel.topic, []).append(message)
    return request.param, messages


def compute_joints(urdf, angles):
    """Frames of the URDF in the root, by name, as pinocchio has them."""
    model = pinocchio.buildModelFromXML(urdf)
    data = model.createData()
    q = pinocchio.neutral(model)
    for name, value in angles.items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    pinocchio.framesForwardKinematics(model, data, q)
    return {
        frame.name: data.oMf[index].homogeneous.copy() for index, frame in enumerate(model.frames)
    }


@pytest.mark.parametrize("model", MODELS, ids=[model.name for model in MODELS])
def test_pinocchio_computes_the_same_positions_of_all_15_joints(model):
    shape = shape_of(model)
    urdf = make_urdf(model, shape, "me")
    for dof in moving(model, 60)[::15]:
        dof[:ROOT_DOF] = 0.0
        angles = dict(zip(model.angle_names, dof[ROOT_DOF:], strict=True))
        frames = compute_joints(urdf, angles)
        pose = ForwardKinematics(model, shape.offsets).pose(dof)
        for joint, index in JOINT_INDEX.items():
            found = frames[joint_frame(model, joint, "me")][:3, 3]
            np.testing.assert_allclose(found, pose.positions[index], atol=MM, err_msg=joint)


def test_recorded_urdf_joint_states_and_tf_agree_in_pinocchio(decoded):
    model, messages = decoded
    (urdf,) = messages["/humans/bodies/subject/urdf"]
    for states, tf, skeleton in zip(
        messages["/humans/bodies/subject/joint_states"],
        messages["/tf"],
        messages["/humans/bodies/subject/skeleton"],
        strict=True,
    ):
        frames = compute_joints(urdf.data, dict(zip(states.name, states.position, strict=True)))
        body = next(t for t in tf.transforms if t.child_frame_id == "body_subject")
        for transform in tf.transforms:
            if transform is body:
                continue
            assert transform.header.frame_id == "body_subject"
            p = transform.transform.translation
            found = frames[transform.child_frame_id][:3, 3]
            np.testing.assert_allclose(found, [p.x, p.y, p.z], atol=MM)
        q = body.transform.rotation
        R_map_body = pinocchio.Quaternion(q.w, q.x, q.y, q.z).matrix()
        t = body.transform.translation
        for joint, p in zip(skeleton.name, skeleton.position, strict=True):
            found = R_map_body @ frames[joint_frame(model, joint, "subject")][:3, 3] + [
                t.x,
                t.y,
                t.z,
            ]
            np.testing.assert_allclose(found, [p.x, p.y, p.z], atol=MM)


def test_every_link_of_the_recorded_urdf_has_a_transform(decoded):
    _, messages = decoded
    (urdf,) = messages["/humans/bodies/subject/urdf"]
    links = {link.get("name") for link in ElementTree.fromstring(urdf.data).iter("link")}
    assert messages["/tf"]
    for tf in messages["/tf"]:
        assert {transform.child_frame_id for transform in tf.transforms} == links


def test_a_bag_carries_the_definition_of_every_message_it_holds(decoded):
    _, messages = decoded
    markers = messages["/humans/bodies/subject/markers"][0].markers
    assert set(messages) >= {"/tf", "/humans/bodies/subject/estimate"}
    assert messages["/humans/bodies/subject/estimate"][0].id == "subject"
    assert len(markers[1].points) == len(JOINT_INDEX)
