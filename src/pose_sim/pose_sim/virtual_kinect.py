"""A virtual Kinect: what a depth camera's skeleton tracker makes of the moving body.

An error has a constant part (where the tracker believes a joint to lie in the body), a slow part
that grows with movement and where a joint is hard to see, white noise, and gross glitches. The
sizes are in :mod:`pose_sim.kinect_noise`.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter
from scipy.special import ndtr

from pose_common.joints import JOINT_INDEX, JOINTS, SIDES, TrackingState
from pose_sim.kinect_noise import KinectParameters
from pose_sim.motion import Motion
from pose_sim.occlusion import hidden
from pose_sim.rotations import FloatArray

NS_PER_S = 1_000_000_000
FIELD_OF_VIEW = (np.radians(70.6), np.radians(60.0))  # [rad] Kinect v2 depth camera, wide and high
DECISION_TIME = 0.4  # [s] for which the tracker keeps an opinion of a joint
ATTENTION_TIME = 0.06  # [s] the tracker takes to find or lose a joint
MEMORY_TIME = 0.7  # [s] over which it remembers where a joint was
QUICK = 1.6  # [m/s] beyond which it gets no worse
SPEED_EXPONENT = 1.5  # [-] trackers do slow movements well, quick ones badly
GLITCH_TIME = 0.12  # [s]

LIMB_PARENTS = {
    f"{side}_{joint}": f"{side}_{parent}"
    for side in SIDES
    for joint, parent in (
        ("elbow", "shoulder"),
        ("hand", "elbow"),
        ("knee", "hip"),
        ("foot", "knee"),
    )
}
RESTLESSNESS = {"hand": 1.0, "foot": 1.2, "elbow": 0.7, "knee": 1.0, "hip": 0.8, "shoulder": 0.7}
"""Wander by joint, relative; the trunk's joints have 0.6."""


@dataclass(frozen=True, kw_only=True)
class KinectFrames:
    """What one virtual Kinect delivers: n frames of one person."""

    capture_s: FloatArray  # (n,) [s] true time of capture on the host's clock
    host_time_ns: NDArray[np.int64]  # (n,) [ns] arrival at the host
    sensor_time_ns: NDArray[np.int64]  # (n,) [ns] capture on the sensor's clock
    positions: FloatArray  # (n, 15, 3) [m] in the optical frame; NaN where not tracked
    tracking_state: NDArray[np.uint8]  # (n, 15)

    def after(self, host_time_ns: int) -> "KinectFrames":
        """The frames that arrived later than a host time [ns]."""
        later = self.host_time_ns > host_time_ns
        return KinectFrames(**{name: column[later] for name, column in vars(self).items()})

    def stamped_later(self, offset_ns: int) -> "KinectFrames":
        """The same frames as a host reports them whose clock is ``offset_ns`` [ns] ahead."""
        return replace(self, host_time_ns=self.host_time_ns + offset_ns)


def observe(
    motion: Motion,
    T_map_optical: FloatArray,
    parameters: KinectParameters,
    *,
    body_height: float,
    body_bias: FloatArray,
    rng: np.random.Generator,
) -> KinectFrames:
    """Let a Kinect watch a motion.

    Args:
        motion: What the subject does.
        T_map_optical: The sensor's pose, shape (4, 4).
        parameters: Rates, delays and errors.
        body_height: The subject's height [m].
        body_bias: The part of the joints' constant offsets that all sensors share, standard normal
            variates, shape (15, 3); see :func:`draw_body_bias`.
        rng: Source of everything random.
    """
    times, host_ns, sensor_ns = _clocks(float(motion.times[-1]), parameters, rng)
    truth = motion.joints_at(times)
    camera = T_map_optical[:3, 3]
    seen = _optical(truth, T_map_optical)
    blocked = np.maximum(hidden(truth, camera, body_height), _out_of_view(seen))
    blocked = _attention(blocked, parameters)
    pointing = _attention(_foreshortening(truth, camera), parameters)
    velocity = np.gradient(truth, times, axis=0)
    estimate = _tracked(truth, velocity, blocked, pointing, parameters, rng)
    estimate += _bias(truth, camera, parameters, body_bias, rng)
    wrong = _wander(velocity, blocked, pointing, parameters, rng)
    wrong += _glitches(velocity, parameters, rng)
    estimate += _with_stiff_bones(wrong, truth, parameters)
    positions = _optical(estimate, T_map_optical) + _white_noise(seen, parameters, rng)
    state = _states(blocked, parameters, rng)
    positions[state == TrackingState.NOT_TRACKED] = np.nan
    return KinectFrames(
        capture_s=times,
        host_time_ns=host_ns,
        sensor_time_ns=sensor_ns,
        positions=positions,
        tracking_state=state,
    )


def draw_body_bias(rng: np.random.Generator) -> FloatArray:
    """What every sensor of a kind gets wrong alike with one body, shape (15, 3)."""
    return rng.standard_normal((len(JOINTS), 3))


def _clocks(
    duration: float, p: KinectParameters, rng: np.random.Generator
) -> tuple[FloatArray, NDArray[np.int64], NDArray[np.int64]]:
    """Capture [s], arrival [ns] and sensor clock [ns] of the frames that arrive."""
    period = 1.0 / p.frame_rate
    phase, boot = rng.uniform(0.0, period), rng.uniform(10.0, 5000.0)  # [s]
    drift = 1e-6 * p.clock_drift * rng.standard_normal()
    count = int((duration - phase) / (period * (1.0 - drift))) + 1
    sensor = boot + period * np.arange(count)  # the sensor's own clock paces it
    capture = (phase + (sensor - boot) * (1.0 - drift)).astype(np.float64)
    capture = capture[capture <= duration]
    sensor = sensor[: len(capture)]
    arrival = capture + p.latency + rng.exponential(1.0, len(capture)) * p.arrival_jitter
    arrival_ns = np.round(arrival * NS_PER_S).astype(np.int64)
    steps = np.arange(len(capture))
    arrival_ns = np.maximum.accumulate(arrival_ns - steps) + steps  # in order, never at once
    kept = rng.random(len(capture)) >= p.dropped_share
    sensor_ns = np.round(sensor * NS_PER_S).astype(np.int64)
    return capture[kept], arrival_ns[kept], sensor_ns[kept]


def _optical(points: FloatArray, T_map_optical: FloatArray) -> FloatArray:
    optical: FloatArray = (points - T_map_optical[:3, 3]) @ T_map_optical[:3, :3]
    return optical


def _out_of_view(optical: FloatArray) -> FloatArray:
    wide, high = (np.tan(0.5 * angle) for angle in FIELD_OF_VIEW)
    depth = np.maximum(optical[..., 2], 1e-3)
    return (
        (np.abs(optical[..., 0]) > wide * depth) | (np.abs(optical[..., 1]) > high * depth)
    ).astype(float)


def _attention(difficulty: FloatArray, p: KinectParameters) -> FloatArray:
    return gaussian_filter1d(difficulty, ATTENTION_TIME * p.frame_rate, axis=0, mode="nearest")


def _foreshortening(joints: FloatArray, camera: FloatArray) -> FloatArray:
    """How much each limb points along the line of sight, 0 to 1, at its far joint; (n, 15)."""
    pointing = np.zeros(joints.shape[:2])
    for joint, parent in LIMB_PARENTS.items():
        far, near = joints[:, JOINT_INDEX[joint]], joints[:, JOINT_INDEX[parent]]
        limb, sight = far - near, far - camera
        cosine = np.einsum("ni,ni->n", limb, sight)
        cosine /= np.linalg.norm(limb, axis=1) * np.linalg.norm(sight, axis=1)
        pointing[:, JOINT_INDEX[joint]] = cosine**4
    return pointing


def _tracked(
    truth: FloatArray,
    velocity: FloatArray,
    blocked: FloatArray,
    pointing: FloatArray,
    p: KinectParameters,
    rng: np.random.Generator,
) -> FloatArray:
    """Where the tracker's inertia and smoothing put the joints."""
    lags = p.lag * rng.uniform(0.5, 1.5, len(JOINTS))
    late = truth - lags[:, None] * velocity
    root = 0.5 * (late[:, [JOINT_INDEX["left_hip"]]] + late[:, [JOINT_INDEX["right_hip"]]])
    keep = np.exp(-1.0 / (p.frame_rate * MEMORY_TIME))
    relative = late - root
    start = keep * relative[:1]
    remembered, _ = lfilter([1.0 - keep], [1.0, -keep], relative, axis=0, zi=start)
    quick = (_pace(velocity, p) / QUICK) ** 2
    pull = p.inertia * np.clip(blocked + pointing + quick, 0.0, 1.0)
    pulled: FloatArray = late + pull[..., None] * (remembered - relative)
    return pulled


def _bias(
    truth: FloatArray,
    camera: FloatArray,
    p: KinectParameters,
    body_bias: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Constant offsets that turn with the trunk, and the skin's that points to the camera."""
    own = rng.standard_normal((len(JOINTS), 3))
    constant = p.joint_bias * np.sqrt(0.5) * (body_bias + own)
    left, right = truth[:, JOINT_INDEX["left_hip"]], truth[:, JOINT_INDEX["right_hip"]]
    heading = np.arctan2(right[:, 0] - left[:, 0], left[:, 1] - right[:, 1])  # y: (-sin, cos)
    cosine, sine = np.cos(heading), np.sin(heading)
    turned = np.empty_like(truth)
    turned[..., 0] = cosine[:, None] * constant[:, 0] - sine[:, None] * constant[:, 1]
    turned[..., 1] = sine[:, None] * constant[:, 0] + cosine[:, None] * constant[:, 1]
    turned[..., 2] = constant[:, 2]
    sight = camera - truth
    towards = sight / np.linalg.norm(sight, axis=2, keepdims=True)
    depth = p.flesh_offset * rng.uniform(0.5, 1.5, len(JOINTS))
    return turned + depth[:, None] * towards


def _wander(
    velocity: FloatArray,
    blocked: FloatArray,
    pointing: FloatArray,
    p: KinectParameters,
    rng: np.random.Generator,
) -> FloatArray:
    """Slow errors: small at rest, larger in movement and where a joint is hard to see."""
    pace = np.minimum(_pace(velocity, p), QUICK)
    size = p.wander_still + p.wander_moving * pace**SPEED_EXPONENT
    stirred = 0.4 + 0.6 * np.minimum(pace / 0.5, 1.0)  # a guess at rest wanders less
    size = size + p.hidden_error * blocked * stirred + p.foreshortened_error * pointing
    gains = [RESTLESSNESS.get(name.split("_")[-1], 0.6) for name in JOINTS]
    process = _slow(truth_shape=velocity.shape, seconds=p.wander_time, p=p, rng=rng)
    wander: FloatArray = (np.array(gains) * size)[..., None] * process
    return wander


def _with_stiff_bones(wrong: FloatArray, truth: FloatArray, p: KinectParameters) -> FloatArray:
    """Errors as a tracker makes them that knows how long limbs are, more or less."""
    wrong = wrong.copy()
    for joint, parent in LIMB_PARENTS.items():  # from the trunk outwards
        far, near = JOINT_INDEX[joint], JOINT_INDEX[parent]
        bone = truth[:, far] - truth[:, near]
        along = bone / np.linalg.norm(bone, axis=1, keepdims=True)
        stretch = np.einsum("ni,ni->n", wrong[:, far] - wrong[:, near], along)
        wrong[:, far] -= p.bone_stiffness * stretch[:, None] * along
    return wrong


def _pace(velocity: FloatArray, p: KinectParameters) -> FloatArray:
    """Each joint's speed [m/s], as it is around each frame."""
    speed = np.linalg.norm(velocity, axis=2)
    return gaussian_filter1d(speed, 0.15 * p.frame_rate, axis=0, mode="nearest")


def _slow(
    truth_shape: tuple[int, ...], seconds: float, p: KinectParameters, rng: np.random.Generator
) -> FloatArray:
    """Unit-variance Ornstein-Uhlenbeck processes along the first axis."""
    keep = np.exp(-1.0 / (p.frame_rate * seconds))
    noise = rng.standard_normal(truth_shape)
    noise[1:] *= np.sqrt(1.0 - keep**2)
    process: FloatArray = lfilter([1.0], [1.0, -keep], noise, axis=0)
    return process


def _glitches(velocity: FloatArray, p: KinectParameters, rng: np.random.Generator) -> FloatArray:
    """Short gross errors of joints that move."""
    moving = np.linalg.norm(velocity, axis=2) > 0.15
    chance = p.glitch_rate / 60.0 / p.frame_rate
    struck = (rng.random(moving.shape) < chance) & moving
    size = rng.standard_normal(velocity.shape) * struck[..., None]
    width = GLITCH_TIME * p.frame_rate / 2.0
    spread = gaussian_filter1d(size, width, axis=0, mode="constant")
    spread *= np.sqrt(2.0 * np.pi) * width  # a glitch's peak has the size drawn
    glitches: FloatArray = p.glitch_size / np.sqrt(3.0) * spread
    return glitches


def _white_noise(optical: FloatArray, p: KinectParameters, rng: np.random.Generator) -> FloatArray:
    depth = optical[..., 2]
    noise = rng.standard_normal(optical.shape)
    noise[..., :2] *= (p.white_noise * depth / 2.0)[..., None]
    noise[..., 2] *= p.depth_noise * depth**2  # Khoshelham and Elberink (2012), Sensors 12(2)
    return noise


def _states(
    blocked: FloatArray, p: KinectParameters, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """What the tracker says of each joint; its opinions last."""
    believes = ndtr(_slow(blocked.shape, DECISION_TIME, p, rng))
    loses = ndtr(_slow(blocked.shape, DECISION_TIME, p, rng))
    is_hidden = blocked > 0.5
    state = np.full(blocked.shape, TrackingState.TRACKED, dtype=np.uint8)
    state[is_hidden & (believes >= p.wrongly_tracked)] = TrackingState.INFERRED
    share = np.where(is_hidden, p.hidden_lost_share, p.lost_share)
    state[loses < share] = TrackingState.NOT_TRACKED
    return state
