"""A bag's ``joint_states``, as a subscriber heard them."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from pose_core.api import ROOT_DOF, FloatArray
from pose_core.errors import InputError
from pose_evaluation.stream_quality import AngleStream
from pose_io.bags import BagReader, open_bag
from pose_io.robot_motion import read_joint_motion
from pose_io.skeleton_messages import stamp_ns


def published_stream(path: Path, subject: str = "subject") -> AngleStream:
    """The person's stream of joint angles in a recorded bag, with the limits of its ``urdf``.

    Raises:
        InputError: If the bag lacks the person's joint states, estimates or tree.
    """
    body = f"humans/bodies/{subject}"
    with open_bag(path) as bag:
        motion = read_joint_motion(bag, f"{body}/joint_states")
        if motion is None or len(motion.stamps_ns) < 2:
            raise InputError(f"{path} holds no /{body}/joint_states: record what the fusion sends")
        stddev = _deviations(bag, f"/{body}/estimate")
        limits = _limits(bag, f"/{body}/urdf")
    unknown = np.full(len(motion.joints), np.nan)
    return AngleStream(
        stamps_ns=motion.stamps_ns,
        arrivals_ns=motion.recorded_ns,
        position=motion.position,
        velocity=motion.velocity,
        stddev=np.array([stddev.get(stamp, unknown) for stamp in motion.stamps_ns.tolist()]),
        limits=np.array([limits[name] for name in motion.joints]),
    )


def _deviations(bag: BagReader, topic: str) -> dict[int, FloatArray]:
    """Standard deviations of the joint angles [rad], by stamp."""
    estimates = (bag.deserialize(message) for message in bag.messages([topic]))
    return {
        stamp_ns(estimate.header): np.asarray(estimate.position_stddev)[ROOT_DOF:]
        for estimate in estimates
    }


def _limits(bag: BagReader, topic: str) -> dict[str, tuple[float, float]]:
    """Lower and upper limit [rad] of each joint of the last tree."""
    texts = [bag.deserialize(message).data for message in bag.messages([topic])]
    if not texts:
        raise InputError(f"the bag has no {topic}: record it too")
    joints = ElementTree.fromstring(texts[-1]).iter("joint")
    found = {joint.get("name", ""): joint.find("limit") for joint in joints}
    return {
        name: (float(limit.get("lower", "-inf")), float(limit.get("upper", "inf")))
        for name, limit in found.items()
        if limit is not None
    }
