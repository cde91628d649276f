"""Errors of a virtual Kinect's skeletons: parameters and presets."""

from dataclasses import dataclass, replace

from pose_core.parameters import parameter
from pose_sim.sizes import scaled, size


@dataclass(frozen=True, kw_only=True)
class KinectParameters:
    """Parameters of a virtual Kinect; lengths are standard deviations unless stated otherwise."""

    frame_rate: float = parameter(30.0, unit="Hz", limits=(1.0, 120.0), doc="frame rate")
    clock_drift: float = size(40.0, "ppm", 1000.0, "drift of the sensor's clock")
    latency: float = size(0.015, "s", 0.5, "minimum latency from capture to arrival at the host")
    arrival_jitter: float = size(0.003, "s", 0.2, "mean of the additional latency")
    clock_offset: float = parameter(
        0.0,
        unit="s",
        limits=(-0.5, 0.5),
        doc="delay of the second sensor's stamps relative to the first's",
    )
    dropped_share: float = size(0.01, "-", 0.9, "share of frames that are lost")
    white_noise: float = size(0.0015, "m", 0.1, "white noise across the line of sight at 2 m")
    depth_noise: float = size(
        0.0004, "m/m^2", 0.1, "white noise along the line of sight, times the squared depth"
    )
    joint_bias: float = size(
        0.012,
        "m",
        0.2,
        "constant offset of each joint in the body, half of it common to all sensors",
    )
    flesh_offset: float = size(
        0.015, "m", 0.2, "mean offset of joints towards the sensor, which sees skin and clothes"
    )
    pose_bias: float = size(
        0.018,
        "m",
        0.2,
        "change of a joint's offset with the direction of its limb, at one radian from hanging",
    )
    wander_still: float = size(0.0015, "m", 0.2, "slow random error of each joint at rest")
    wander_moving: float = size(
        0.030, "s", 0.5, "increase of the slow error with the joint's speed, up to 0.8 m/s"
    )
    wander_time: float = parameter(
        0.4, unit="s", limits=(0.01, 10.0), doc="correlation time of the slow error"
    )
    bone_stiffness: float = size(
        0.2, "-", 1.0, "degree to which the tracker's errors preserve a limb's length"
    )
    arm_likeness: float = size(0.8, "-", 1.0, "correlation of the errors of elbow and hand")
    hidden_error: float = size(
        0.08, "m", 1.0, "increase of the slow error of a hidden joint, 40 % of it at rest"
    )
    foreshortened_error: float = size(
        0.05,
        "m",
        1.0,
        "increase of the slow error of a limb's far joint if the limb points at the sensor",
    )
    inertia: float = size(
        0.5, "-", 1.0, "degree to which a joint that is hard to see stays at its recent position"
    )
    lag: float = size(0.04, "s", 0.5, "mean delay of the tracker's smoothing")
    own_lag: float = size(
        0.15,
        "-",
        1.0,
        "share of the delays' variation between joints that is specific to the sensor; 0: equal"
        " for all sensors",
    )
    glitch_rate: float = size(1.0, "1/min", 600.0, "short gross errors of each moving joint")
    glitch_size: float = size(0.15, "m", 2.0, "size of these gross errors")
    wrongly_tracked: float = size(0.25, "-", 1.0, "share of hidden joints reported as tracked")
    lost_share: float = size(
        0.004, "-", 0.9, "share of time in which a visible joint is not tracked"
    )
    hidden_lost_share: float = size(
        0.05, "-", 0.9, "share of time in which a hidden joint is not tracked"
    )


TYPICAL = KinectParameters()
_ALIKE = (
    *("frame_rate", "clock_drift", "latency", "arrival_jitter", "clock_offset"),
    *("wander_time", "bone_stiffness", "arm_likeness", "own_lag", "glitch_size"),
)
"""Parameters that are the same in all presets; the others are errors."""


CLEAN = replace(scaled(TYPICAL, 0.0, _ALIKE), clock_drift=0.0, arrival_jitter=0.0)
EASY = scaled(TYPICAL, 0.5, _ALIKE)
HARD = scaled(TYPICAL, 2.0, _ALIKE)
PRESETS = {"clean": CLEAN, "easy": EASY, "typical": TYPICAL, "hard": HARD}
"""``clean``: no errors but hidden joints' states; ``easy``: half of ``typical``'s errors;
``typical``: a Kinect v2 with its own tracker; ``hard``: twice that, close to published errors of
Kinect v2 with NiTE2."""
