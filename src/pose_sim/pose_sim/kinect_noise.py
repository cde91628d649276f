"""Errors of a virtual Kinect's skeletons: parameters and presets."""

from dataclasses import dataclass, replace

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class KinectParameters:
    """Parameters of a virtual Kinect; lengths are standard deviations unless stated otherwise."""

    frame_rate: float = parameter(30.0, unit="Hz", limits=(1.0, 120.0), doc="frame rate")
    clock_drift: float = parameter(
        40.0, unit="ppm", limits=(0.0, 1000.0), doc="drift of the sensor's clock"
    )
    latency: float = parameter(
        0.015,
        unit="s",
        limits=(0.0, 0.5),
        doc="minimum latency from capture to arrival at the host",
    )
    arrival_jitter: float = parameter(
        0.003, unit="s", limits=(0.0, 0.2), doc="mean of the additional latency"
    )
    clock_offset: float = parameter(
        0.0,
        unit="s",
        limits=(-0.5, 0.5),
        doc="delay of the second sensor's stamps relative to the first's",
    )
    dropped_share: float = parameter(0.01, limits=(0.0, 0.9), doc="share of frames that are lost")
    white_noise: float = parameter(
        0.0015, unit="m", limits=(0.0, 0.1), doc="white noise across the line of sight at 2 m"
    )
    depth_noise: float = parameter(
        0.0004,
        unit="m/m^2",
        limits=(0.0, 0.1),
        doc="white noise along the line of sight, times the squared depth",
    )
    joint_bias: float = parameter(
        0.012,
        unit="m",
        limits=(0.0, 0.2),
        doc="constant offset of each joint in the body, half of it common to all sensors",
    )
    flesh_offset: float = parameter(
        0.015,
        unit="m",
        limits=(0.0, 0.2),
        doc="mean offset of joints towards the sensor, which sees skin and clothes",
    )
    pose_bias: float = parameter(
        0.018,
        unit="m",
        limits=(0.0, 0.2),
        doc="change of a joint's offset with the direction of its limb, at one radian from hanging",
    )
    wander_still: float = parameter(
        0.0015, unit="m", limits=(0.0, 0.2), doc="slow random error of each joint at rest"
    )
    wander_moving: float = parameter(
        0.030,
        unit="s",
        limits=(0.0, 0.5),
        doc="increase of the slow error with the joint's speed, up to 0.8 m/s",
    )
    wander_time: float = parameter(
        0.4, unit="s", limits=(0.01, 10.0), doc="correlation time of the slow error"
    )
    bone_stiffness: float = parameter(
        0.2, limits=(0.0, 1.0), doc="degree to which the tracker's errors preserve a limb's length"
    )
    arm_likeness: float = parameter(
        0.8, limits=(0.0, 1.0), doc="correlation of the errors of elbow and hand"
    )
    hidden_error: float = parameter(
        0.08,
        unit="m",
        limits=(0.0, 1.0),
        doc="increase of the slow error of a hidden joint, 40 % of it at rest",
    )
    foreshortened_error: float = parameter(
        0.05,
        unit="m",
        limits=(0.0, 1.0),
        doc="increase of the slow error of a limb's far joint if the limb points at the sensor",
    )
    inertia: float = parameter(
        0.5,
        limits=(0.0, 1.0),
        doc="degree to which a joint that is hard to see stays at its recent position",
    )
    lag: float = parameter(
        0.04, unit="s", limits=(0.0, 0.5), doc="mean delay of the tracker's smoothing"
    )
    own_lag: float = parameter(
        0.15,
        limits=(0.0, 1.0),
        doc="share of the delays' variation between joints that is specific to the sensor; 0:"
        " equal for all sensors",
    )
    glitch_rate: float = parameter(
        1.0, unit="1/min", limits=(0.0, 600.0), doc="short gross errors of each moving joint"
    )
    glitch_size: float = parameter(
        0.15, unit="m", limits=(0.0, 2.0), doc="size of these gross errors"
    )
    wrongly_tracked: float = parameter(
        0.25, limits=(0.0, 1.0), doc="share of hidden joints reported as tracked"
    )
    lost_share: float = parameter(
        0.004, limits=(0.0, 0.9), doc="share of time in which a visible joint is not tracked"
    )
    hidden_lost_share: float = parameter(
        0.05, limits=(0.0, 0.9), doc="share of time in which a hidden joint is not tracked"
    )


TYPICAL = KinectParameters()
_ALIKE = (
    *("frame_rate", "clock_drift", "latency", "arrival_jitter", "clock_offset"),
    *("wander_time", "bone_stiffness", "arm_likeness", "own_lag", "glitch_size"),
)
"""Parameters that are the same in all presets; the others are errors."""


def _scaled(factor: float) -> KinectParameters:
    errors = {name: factor * value for name, value in vars(TYPICAL).items() if name not in _ALIKE}
    return replace(TYPICAL, **errors)


CLEAN = replace(_scaled(0.0), clock_drift=0.0, arrival_jitter=0.0)
EASY = _scaled(0.5)
HARD = _scaled(2.0)
PRESETS = {"clean": CLEAN, "easy": EASY, "typical": TYPICAL, "hard": HARD}
"""``clean``: no errors but hidden joints' states; ``easy``: half of ``typical``'s errors;
``typical``: a Kinect v2 with its own tracker; ``hard``: twice that, close to published errors of
Kinect v2 with NiTE2."""
