"""A body of known shape and motion that the model of li2020 can follow exactly (synthetic)."""

import numpy as np

from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import load_body_model
from pose_core.body.shape import BodyShape
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES, TrackingState
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.samples import SkeletonSample

FRAME_NS = 33_333_333
MODEL = load_body_model("li2020")


def body_offsets():
    """Offsets (15, 3) [m] of a person of about 1.75 m."""
    offsets = np.zeros((len(JOINTS), 3))
    offsets[JOINT_INDEX["neck"]] = [0.0, 0.0, 0.5]
    offsets[JOINT_INDEX["torso"]] = [0.01, 0.0, 0.25]
    offsets[JOINT_INDEX["head"]] = [0.0, 0.0, 0.2]
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        offsets[JOINT_INDEX[f"{side}_hip"]] = [0.0, 0.09 * sign, 0.0]
        offsets[JOINT_INDEX[f"{side}_shoulder"]] = [0.0, 0.18 * sign, 0.43]
        offsets[JOINT_INDEX[f"{side}_elbow"]] = [0.0, 0.0, -0.30]
        offsets[JOINT_INDEX[f"{side}_hand"]] = [0.0, 0.0, -0.28]
        offsets[JOINT_INDEX[f"{side}_knee"]] = [0.0, 0.0, -0.42]
        offsets[JOINT_INDEX[f"{side}_foot"]] = [0.0, 0.0, -0.40]
    return offsets


SHAPE = BodyShape(offsets=body_offsets())


def kinematics():
    """Forward kinematics of the body."""
    return ForwardKinematics(MODEL, SHAPE.offsets)


def random_dof(rng, count=1, spread=0.6):
    """Degrees of freedom (count, 24) in the range where angles are unique."""
    dof = rng.uniform(-spread, spread, (count, MODEL.size))
    for name, index in MODEL.dof_index.items():
        if "elbow" in name or "knee" in name:
            dof[:, index] = rng.uniform(0.4, 1.8, count)
    return dof


def motion(duration_s, still_s=3.0, lean=0.0):
    """Stand still, then swing the limbs and bend them: degrees of freedom (n, 24) at 30 Hz.

    The person faces the first sensor: the root is turned by half a turn in map. The trunk leans to
    all sides by up to about ``lean`` [rad].
    """
    t = np.arange(round(duration_s * 30)) / 30.0
    grow = np.clip((t - still_s) / 2.0, 0.0, 1.0) ** 2
    dof = np.zeros((len(t), MODEL.size))
    dof[:, :3] = np.stack([2.0 + 0.1 * grow * np.sin(t), 0.0 * t, 0.9 + 0.0 * t], axis=1)
    dof[:, 5] = np.pi + 0.2 * grow * np.sin(0.4 * t)
    dof[:, 3] = 0.5 * lean * grow * np.sin(1.9 * t)  # of half a turn, half a tilt
    dof[:, 4] = 0.5 * lean * grow * np.sin(1.3 * t)
    for order, name in enumerate(MODEL.angle_names):
        amplitude = 0.5 if name.endswith(("flexion", "abduction")) else 0.1
        if name.startswith("neck"):
            amplitude = 0.1
        wave = np.sin(2.0 * np.pi * (0.25 + 0.01 * order) * (t - still_s))
        hinge = "elbow" in name or "knee" in name
        value = amplitude * (wave + 1.0 if hinge else wave)
        dof[:, MODEL.dof_index[name]] = grow * value
    return t, dof


def extrinsics():
    """Two sensors: one looks along map's x, the other is turned by 40 degrees beside it."""
    T_map_left = np.eye(4)
    T_map_left[:3, :3] = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    T_map_left[2, 3] = 1.3
    turn = np.radians(40.0)
    T_left_right = np.eye(4)
    T_left_right[:3, :3] = [
        [np.cos(turn), 0.0, -np.sin(turn)],
        [0.0, 1.0, 0.0],
        [np.sin(turn), 0.0, np.cos(turn)],
    ]
    T_left_right[:3, 3] = [1.2, 0.0, 0.4]
    return Extrinsics(
        reference="left",
        T_reference_sensor={"left": np.eye(4), "right": T_left_right},
        T_map_reference=T_map_left,
    )


def skeleton_samples(positions, placed, rng=None, noise=0.0, start_ns=10**18, phase=0.4):
    """What both sensors see, each at its own phase, in the order of capture.

    Args:
        positions: Joints in map at 30 Hz, shape (n, 15, 3) [m].
        placed: Extrinsics.
        rng: Of the noise.
        noise: Standard deviation [m].
        start_ns: First stamp.
        phase: By how much of a period the second sensor is later.
    """
    samples = []
    count = len(positions)
    for share, sensor in ((0.0, "left"), (phase, "right")):
        T_sensor_map = np.linalg.inv(placed.T_map_sensor(sensor))
        for k in range(count - 1):
            seen = (1.0 - share) * positions[k] + share * positions[k + 1]
            seen = seen @ T_sensor_map[:3, :3].T + T_sensor_map[:3, 3]
            if rng is not None:
                seen = seen + rng.normal(0.0, noise, seen.shape)
            samples.append(
                SkeletonSample(
                    stamp_ns=start_ns + round((k + share) * FRAME_NS),
                    sensor=sensor,
                    person="1",
                    positions=seen,
                    tracking_state=np.full(len(JOINTS), TrackingState.TRACKED, np.uint8),
                )
            )
    return sorted(samples, key=lambda sample: sample.stamp_ns)
