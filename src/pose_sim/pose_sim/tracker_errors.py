"""Errors of a simulated skeleton tracker; their sizes are in :mod:`pose_sim.kinect_noise`."""

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from pose_core.arrays import FloatArray, unit_vectors
from pose_core.joints import JOINT_INDEX, JOINTS, LIMB_ENDS, SIDES
from pose_sim.captured.clips import heading, mid_hip
from pose_sim.kinect_noise import KinectParameters
from pose_sim.rotations import about_z

ATTENTION_TIME = 0.06  # [s] in which the tracker detects or loses a joint
MEMORY_TIME = 0.7  # [s] time constant of the position of a lost joint
FAST = 0.8  # [m/s] speed above which the slow error is constant
TOO_FAST = 3.0  # [m/s] speed at which the tracker loses a joint
GLITCH_TIME = 0.12  # [s]
NEUTRAL = np.array([0.0, 0.0, -1.0])  # direction of a hanging limb

LIMB_PARENTS = {joint: parent for parent, joint in LIMB_ENDS.values()}
DIRECTIONS = {
    **{parent: (parent, joint) for joint, parent in LIMB_PARENTS.items()},
    **{joint: (parent, joint) for joint, parent in LIMB_PARENTS.items()},
}
"""The limb whose direction determines a joint's offset."""
ARMS = tuple((JOINT_INDEX[f"{side}_elbow"], JOINT_INDEX[f"{side}_hand"]) for side in SIDES)
"""Joints with correlated errors."""
RESTLESSNESS = {
    **dict.fromkeys(("head", "neck", "torso", "shoulder"), 0.8),
    "elbow": 0.5,
    "hand": 0.65,
    "hip": 1.2,
    "knee": 2.0,
    "foot": 1.9,
}
"""Relative increase of a joint's slow error with its speed: larger for legs than for arms."""


def attention(difficulty: FloatArray, p: KinectParameters) -> FloatArray:
    """Low-pass filter a difficulty: the tracker reacts with a delay."""
    return gaussian_filter1d(difficulty, ATTENTION_TIME * p.frame_rate, axis=0, mode="nearest")


def low_passed(values: FloatArray, time_s: float, rate: float) -> FloatArray:
    """First-order low-pass filter over the first axis, settled at the first value.

    Args:
        values: Shape (n, …).
        time_s: Time constant [s].
        rate: Of the values [Hz].
    """
    keep = np.exp(-1.0 / (rate * time_s))
    filtered, _ = lfilter([1.0 - keep], [1.0, -keep], values, axis=0, zi=keep * values[:1])
    return np.asarray(filtered)


def foreshortening(joints: FloatArray, camera: FloatArray) -> FloatArray:
    """Alignment of each limb with the line of sight, 0 to 1, at its distal joint, (n, 15)."""
    pointing = np.zeros(joints.shape[:2])
    for joint, parent in LIMB_PARENTS.items():
        far, near = joints[:, JOINT_INDEX[joint]], joints[:, JOINT_INDEX[parent]]
        limb, sight = far - near, far - camera
        cosine = np.einsum("ni,ni->n", limb, sight)
        cosine /= np.linalg.norm(limb, axis=1) * np.linalg.norm(sight, axis=1)
        pointing[:, JOINT_INDEX[joint]] = cosine**4
    return pointing


def tracked(
    truth: FloatArray,
    velocity: FloatArray,
    blocked: FloatArray,
    pointing: FloatArray,
    p: KinectParameters,
    common_lags: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Joint positions after the tracker's smoothing and loss of joints, (n, 15, 3) [m]."""
    own = rng.uniform(-0.5, 0.5, len(JOINTS))
    lags = p.lag * (1.0 + p.own_lag * own + np.sqrt(1.0 - p.own_lag**2) * common_lags)
    late = truth - lags[:, None] * velocity
    root = mid_hip(late)[:, None]
    relative = late - root
    remembered = low_passed(relative, MEMORY_TIME, p.frame_rate)
    quick = (_pace(velocity, p) / TOO_FAST) ** 2
    pull = p.inertia * np.clip(blocked + pointing + quick, 0.0, 1.0)
    for upper, lower in ARMS:
        pull[:, [upper, lower]] = np.maximum(pull[:, [upper]], pull[:, [lower]])
    return late + pull[..., None] * (remembered - relative)


def offsets(
    truth: FloatArray,
    camera: FloatArray,
    p: KinectParameters,
    body_bias: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Systematic offsets: fixed to the trunk, dependent on the limb, and towards the camera.

    Half of the constant offsets are specific to the sensor. Their dependence on a limb's direction
    comes from the tracker's definition of the joint and is the same for all sensors.
    """
    own = rng.standard_normal((len(JOINTS), 3))
    constant = p.joint_bias * np.sqrt(0.5) * (body_bias[:, :, 0] + own)
    following = p.pose_bias * body_bias[:, :, 1:]
    _liken_arms(following, p)
    R_map_body = about_z(heading(truth))
    offset = np.tile(constant, (len(truth), 1, 1))
    for joint, (near, far) in DIRECTIONS.items():
        limb = unit_vectors(truth[:, JOINT_INDEX[far]] - truth[:, JOINT_INDEX[near]])
        change = np.einsum("nji,nj->ni", R_map_body, limb) - NEUTRAL
        offset[:, JOINT_INDEX[joint]] += change @ following[JOINT_INDEX[joint]].T
    turned = np.einsum("nij,nkj->nki", R_map_body, offset)
    towards = unit_vectors(camera - truth)
    depth = p.flesh_offset * rng.uniform(0.5, 1.5, len(JOINTS))
    return turned + depth[:, None] * towards


def wander(
    velocity: FloatArray,
    blocked: FloatArray,
    pointing: FloatArray,
    p: KinectParameters,
    rng: np.random.Generator,
) -> FloatArray:
    """Slow errors: small at rest, larger in movement and where a joint is hard to see."""
    pace = np.minimum(_pace(velocity, p), FAST)
    gains = np.array([RESTLESSNESS[name.split("_")[-1]] for name in JOINTS])
    size = p.wander_still + p.wander_moving * gains * pace
    stirred = 0.4 + 0.6 * np.minimum(pace / 0.5, 1.0)  # inferred joints at rest drift less
    size = size + p.hidden_error * blocked * stirred + p.foreshortened_error * pointing
    process = slow_process(velocity.shape, p.wander_time, p.frame_rate, rng)
    _liken_arms(process.swapaxes(0, 1), p)
    return size[..., None] * process


def with_stiff_bones(wrong: FloatArray, truth: FloatArray, p: KinectParameters) -> FloatArray:
    """Correct errors partially towards constant limb lengths, as trackers do."""
    wrong = wrong.copy()
    for joint, parent in LIMB_PARENTS.items():  # from the trunk outwards
        far, near = JOINT_INDEX[joint], JOINT_INDEX[parent]
        along = unit_vectors(truth[:, far] - truth[:, near])
        stretch = np.einsum("ni,ni->n", wrong[:, far] - wrong[:, near], along)
        wrong[:, far] -= p.bone_stiffness * stretch[:, None] * along
    return wrong


def glitches(velocity: FloatArray, p: KinectParameters, rng: np.random.Generator) -> FloatArray:
    """Short gross errors of joints that move."""
    moving = np.linalg.norm(velocity, axis=2) > 0.15
    chance = p.glitch_rate / 60.0 / p.frame_rate
    struck = (rng.random(moving.shape) < chance) & moving
    size = rng.standard_normal(velocity.shape) * struck[..., None]
    width = GLITCH_TIME * p.frame_rate / 2.0
    spread = gaussian_filter1d(size, width, axis=0, mode="constant")
    spread *= np.sqrt(2.0 * np.pi) * width  # a glitch's peak has the size drawn
    return p.glitch_size / np.sqrt(3.0) * spread


def white_noise(optical: FloatArray, p: KinectParameters, rng: np.random.Generator) -> FloatArray:
    """White noise of the depth camera, for joints (n, 15, 3) [m] in the optical frame."""
    depth = optical[..., 2]
    noise = rng.standard_normal(optical.shape)
    noise[..., :2] *= (p.white_noise * depth / 2.0)[..., None]
    noise[..., 2] *= p.depth_noise * depth**2  # Khoshelham and Elberink (2012), Sensors 12(2)
    return noise


def slow_process(
    shape: tuple[int, ...], seconds: float, rate: float, rng: np.random.Generator
) -> FloatArray:
    """Unit-variance Ornstein-Uhlenbeck processes along the first axis; ``rate`` of it in Hz."""
    keep = np.exp(-1.0 / (seconds * rate))
    noise = rng.standard_normal(shape)
    noise[1:] *= np.sqrt(1.0 - keep**2)
    return lfilter([1.0], [1.0, -keep], noise, axis=0)


def _liken_arms(draws: FloatArray, p: KinectParameters) -> None:
    """Correlate each hand's normal variates, (15, …), with its elbow's, preserving the variance."""
    for upper, lower in ARMS:
        draws[lower] *= np.sqrt(1.0 - p.arm_likeness**2)
        draws[lower] += p.arm_likeness * draws[upper]


def _pace(velocity: FloatArray, p: KinectParameters) -> FloatArray:
    """Smoothed speed of each joint [m/s], (n, 15)."""
    speed = np.linalg.norm(velocity, axis=2)
    return gaussian_filter1d(speed, 0.15 * p.frame_rate, axis=0, mode="nearest")
