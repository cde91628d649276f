"""A synthetic person's motion in a bag, with any body model, for tests of exports."""

from importlib import resources

import numpy as np
import yaml
from scipy.spatial.transform import Rotation
from std_msgs.msg import String
from synthetic_body import body_offsets

from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import ROOT_DOF, available_models, load_body_model, parse_body_model
from pose_core.body.shape import BodyShape
from pose_core.body.urdf import make_urdf
from pose_core.estimates.body_estimates import BodyEstimate
from pose_core.joints import JOINT_INDEX
from pose_fusion.conversions import body_topics, to_bag_message, to_messages, type_name, urdf_topic
from pose_io.bag_writer import BagWriter

START_NS = 1_700_000_000_000_000_000
FRAME_NS = 33_333_333
WAIST = ("waist_flexion", "waist_lateral_bending", "waist_rotation")


def waist_model():
    """The rigid-trunk model with a waist: pelvis and hips below it, 27 degrees of freedom."""
    folder = resources.files("pose_core.body") / "body_models"
    document = yaml.safe_load((folder / "li2020.yaml").read_text())
    document["name"] = "waist"
    links = document["links"]
    axes = ([0, 1, 0], [1, 0, 0], [0, 0, 1])
    waist = [[name, axis, -60, 60] for name, axis in zip(WAIST, axes, strict=True)]
    trunk = {"parent": "pelvis", "joint": "torso", "dof": waist}
    for name, link in links.items():
        if link["parent"] == "trunk" and "thigh" in name:
            link["parent"] = "pelvis"
    document["links"] = {
        "pelvis": {"parent": None, "joint": None, "dof": []},
        "trunk": trunk,
        **{name: link for name, link in links.items() if name != "trunk"},
    }
    for joint in ("torso", "left_hip", "right_hip"):
        document["joints"][joint]["link"] = "pelvis"
    document["order"] += WAIST
    document["segments"]["pelvis"] = "pelvis"
    return parse_body_model(document)


def body_models():
    """Every model that comes with the package, and one with a waist whatever comes."""
    return [*(load_body_model(name) for name in available_models()), waist_model()]


def shape_of(model):
    """A person's measures in a model: the joints where they are in the neutral pose."""
    offsets = body_offsets()
    neutral = _neutral(offsets)
    result = np.zeros_like(offsets)
    for name, place in model.joints.items():
        joint = model.links[place.link].joint
        origin = np.zeros(3) if joint is None else neutral[joint]
        result[JOINT_INDEX[name]] = neutral[name] - origin
    return BodyShape(offsets=result)


def _neutral(offsets):
    li2020 = load_body_model("li2020")
    pose = ForwardKinematics(li2020, offsets).pose(np.zeros(li2020.size))
    return {name: pose.positions[index] for name, index in JOINT_INDEX.items()}


def moving(model, count, seed=3):
    """Degrees of freedom (count, d): every one moves, and the person turns round."""
    rng = np.random.default_rng(seed)
    t = np.arange(count)[:, None] / 30.0
    frequency = rng.uniform(0.2, 0.6, model.size)
    dof = 0.4 * np.sin(2.0 * np.pi * frequency * t + rng.uniform(0.0, 6.0, model.size))
    for name, index in model.dof_index.items():
        if "elbow" in name or "knee" in name:
            dof[:, index] = 0.9 + 2.0 * dof[:, index]
    dof[:, :3] += [2.0, 0.3, 0.95]
    dof[:, 3:5] *= 0.3
    dof[:, 5] = np.linspace(0.0, 4.0, count)
    return dof


def write_motion_bag(path, model, count=60, drop=(), unknown=None):
    """A fused bag (synthetic); frames named in ``drop`` are missing. Degrees of freedom, joints.

    ``unknown`` has the frames in which an angle is unknown, by its name.
    """
    dof, shape = moving(model, count), shape_of(model)
    pose = ForwardKinematics(model, shape.offsets).pose(dof)
    with BagWriter(path) as bag:
        for topic, message_type in body_topics("subject").items():
            bag.add_topic(topic, type_name(message_type))
        bag.add_topic(urdf_topic("subject"), "std_msgs/msg/String", latched=True)
        urdf = String(data=make_urdf(model, shape, "subject"))
        bag.write(urdf_topic("subject"), to_bag_message(urdf, bag.typestore), START_NS)
        for index in range(count):
            if index in drop:
                continue
            estimate = _estimate(model, dof[index], pose.rotations[index], pose.positions[index])
            for name, frames in (unknown or {}).items():
                estimate["is_known"][model.dof_index[name]] = index not in frames
            estimate = BodyEstimate(stamp_ns=START_NS + index * FRAME_NS, **estimate)
            for topic, message in to_messages(estimate, model, "subject", 0.01).items():
                bag.write(topic, to_bag_message(message, bag.typestore), estimate.stamp_ns)
    return dof, pose.positions


def _estimate(model, dof, rotations, joints):
    size = model.size
    transforms = np.tile(np.eye(4), (len(model.links), 1, 1))
    transforms[:, :3, :3] = rotations
    for index, link in enumerate(model.links.values()):
        place = dof[:3] if link.joint is None else joints[JOINT_INDEX[link.joint]]
        transforms[index, :3, 3] = place
    return {
        "newest_ns": START_NS,
        "dof_names": model.dof_names,
        "position": dof,
        "velocity": np.zeros(size),
        "position_stddev": np.full(size, 0.01),
        "is_known": np.ones(size, np.bool_),
        "weight_kinect": np.ones(size),
        "weight_imu": np.zeros(size),
        "source": np.ones(size, np.uint8),
        "joints": joints,
        "fk_joints": joints,
        "tracking_state": np.full(len(joints), 2, np.uint8),
        "link_names": model.link_names,
        "T_map_link": transforms,
    }


def root_rotation(dof):
    """``R_map_body``, shape (n, 3, 3)."""
    return Rotation.from_rotvec(dof[:, 3:ROOT_DOF]).as_matrix()


MODELS_BY_NAME = {model.name: model for model in body_models()}
