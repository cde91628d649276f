"""A person who walks about before two or three sensors, for tests of the calibration."""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.streams.samples import SkeletonSample
from pose_core.streams.time_alignment import AlignedFrame

NS = 1_000_000_000
ANKLE = 0.07  # [m] above the floor
LEAN = 0.064  # [-] forwards, so that the centre of mass is 6 cm in front of the ankles
SWAPPED = [
    JOINT_INDEX[name.replace("left_", "#").replace("right_", "left_").replace("#", "right_")]
    for name in JOINTS
]
HALF = {  # y to the left, z up from the floor [m]
    "head": (0.0, 0.0, 1.65),
    "neck": (0.0, 0.0, 1.45),
    "torso": (0.0, 0.0, 1.15),
    "shoulder": (0.0, 0.19, 1.42),
    "elbow": (0.0, 0.22, 1.12),
    "hand": (0.0, 0.23, 0.88),
    "hip": (0.0, 0.09, 0.92),
    "knee": (0.0, 0.1, 0.5),
    "foot": (0.0, 0.1, ANKLE),
}


def sensor_pose(x, y, height, yaw_deg, tilt_deg=0.0, roll_deg=0.0):
    """``T_map_sensor`` of a sensor that looks along the yaw, tilted down."""
    level = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # optical to map
    turn = Rotation.from_euler("ZYX", [yaw_deg, tilt_deg, roll_deg], degrees=True)
    T = np.eye(4)
    T[:3, :3] = turn.as_matrix() @ level
    T[:3, 3] = x, y, height
    return T


LEFT = sensor_pose(0.0, 0.0, 1.2, 0.0, tilt_deg=8.0)
RIGHT = sensor_pose(0.9, -2.0, 1.0, 45.0, tilt_deg=-3.0, roll_deg=2.0)
POSES = {"left": LEFT, "right": RIGHT}


def stance():
    body = np.zeros((len(JOINTS), 3))
    for name, index in JOINT_INDEX.items():
        side, _, joint = name.partition("_")
        body[index] = HALF.get(name) or HALF[joint]
        if side == "right":
            body[index, 1] *= -1.0
    body[:, 0] = LEAN * (body[:, 2] - ANKLE)
    return body


def person_at(time_s, *, walks=True, moves=True):
    """The joints in map, (15, 3): walking round a square of 1.6 m about (2.5, 0)."""
    body = stance()
    if moves:
        for side, phase in (("left", 0.0), ("right", np.pi)):
            raised = 0.8 * (1.0 + np.sin(1.1 * time_s + phase))
            turn = Rotation.from_rotvec([raised if side == "left" else -raised, 0.0, 0.0])
            shoulder = body[JOINT_INDEX[f"{side}_shoulder"]]
            for joint in ("elbow", "hand"):
                index = JOINT_INDEX[f"{side}_{joint}"]
                body[index] = shoulder + turn.apply(body[index] - shoulder)
    x, y, heading = 2.5, 0.0, np.pi
    if walks:
        x += 0.8 * np.sin(0.7 * time_s)
        y += 0.8 * np.sin(0.5 * time_s + 1.0)
        heading += 0.6 * np.sin(0.4 * time_s)
    placed = Rotation.from_rotvec([0.0, 0.0, heading]).apply(body)
    return placed + [x, y, 0.0]


def seen(positions, T_map_sensor, sensor, stamp_ns, rng=None, noise=0.0, person="1"):
    """The joints as a sensor sees them."""
    optical = (positions - T_map_sensor[:3, 3]) @ T_map_sensor[:3, :3]
    if rng is not None:
        optical = optical + rng.normal(0.0, noise, optical.shape)
    return SkeletonSample(
        stamp_ns=stamp_ns,
        sensor=sensor,
        person=person,
        positions=optical,
        tracking_state=np.full(len(JOINTS), 2, dtype=np.uint8),
    )


def frames(duration_s=20.0, rate=15.0, noise=0.01, seed=0, poses=None, **motion):
    """Frames that all sensors saw at the very same instants."""
    rng = np.random.default_rng(seed)
    result = []
    for time_s in np.arange(0.0, duration_s, 1.0 / rate):
        body, stamp_ns = person_at(time_s, **motion), int(time_s * NS) + NS
        samples = {
            name: seen(body, T, name, stamp_ns, rng, noise) for name, T in (poses or POSES).items()
        }
        result.append(AlignedFrame(stamp_ns=stamp_ns, samples=samples))
    return result


def samples(duration_s=20.0, rate=30.0, noise=0.01, seed=0, poses=None, offset_s=None, **motion):
    """Each sensor's samples at a phase of its own, in the order of their stamps.

    ``offset_s``: how far each sensor's clock is ahead [s].
    """
    rng = np.random.default_rng(seed)
    result = []
    for name, T in (poses or POSES).items():
        ahead_s = (offset_s or {}).get(name, 0.0)
        for time_s in np.arange(rng.uniform(0.0, 1.0 / rate), duration_s, 1.0 / rate):
            stamp_ns = int((time_s + ahead_s) * NS) + NS
            result.append(seen(person_at(time_s, **motion), T, name, stamp_ns, rng, noise))
    return sorted(result, key=lambda sample: sample.stamp_ns)


def with_positions(frame, sensor, positions, state=None):
    """The same frame with another view of one sensor."""
    one = frame.samples[sensor]
    changed = SkeletonSample(
        stamp_ns=one.stamp_ns,
        sensor=one.sensor,
        person=one.person,
        positions=positions,
        tracking_state=one.tracking_state if state is None else state,
    )
    return AlignedFrame(stamp_ns=frame.stamp_ns, samples={**frame.samples, sensor: changed})


def angle_deg(T_a, T_b):
    """Angle between two transforms' rotations [deg]."""
    turn = Rotation.from_matrix(T_a[:3, :3].T @ T_b[:3, :3])
    return float(np.degrees(turn.magnitude()))


def with_bent_knees(some):
    """The same samples with knees that are 20 cm in front of hips and feet."""
    names = ("left_knee", "right_knee")
    knees, hips = (
        [JOINT_INDEX[name.replace("knee", j)] for name in names] for j in ("knee", "hip")
    )
    for each in some:
        lateral = each.positions[hips[0]] - each.positions[hips[1]]
        up = each.positions[JOINT_INDEX["neck"]] - each.positions[hips].mean(axis=0)
        forward = np.cross(lateral, up)
        each.positions[knees] += 0.2 * forward / np.linalg.norm(forward)
    return some


def mirrored(some, *sensors):
    """The same samples with x reversed in the views of some sensors."""
    for each in some:
        if each.sensor in sensors:
            each.positions[:, 0] *= -1.0
    return some
