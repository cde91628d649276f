"""What is wrong with a virtual Kinect's skeletons, and how much of it: parameters and presets."""

from dataclasses import dataclass, replace

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class KinectParameters:
    """One virtual Kinect; lengths are standard deviations unless they say otherwise."""

    frame_rate: float = parameter(30.0, unit="Hz", limits=(1.0, 120.0), doc="frames a second")
    clock_drift: float = parameter(
        40.0, unit="ppm", limits=(0.0, 1000.0), doc="drift of the sensor's clock"
    )
    latency: float = parameter(
        0.015, unit="s", limits=(0.0, 0.5), doc="capture to arrival at the host, at least"
    )
    arrival_jitter: float = parameter(
        0.003, unit="s", limits=(0.0, 0.2), doc="mean of what comes on top of the latency"
    )
    clock_offset: float = parameter(
        0.0,
        unit="s",
        limits=(-0.5, 0.5),
        doc="how late the second sensor's stamps are against the first's",
    )
    dropped_share: float = parameter(
        0.01, limits=(0.0, 0.9), doc="share of frames that never arrive"
    )
    white_noise: float = parameter(
        0.0015, unit="m", limits=(0.0, 0.1), doc="white noise across the view at 2 m"
    )
    depth_noise: float = parameter(
        0.0004,
        unit="m/m^2",
        limits=(0.0, 0.1),
        doc="white noise along the view, times the squared depth",
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
        doc="what a limb's direction, a radian from hanging, adds to its joints' offsets",
    )
    wander_still: float = parameter(
        0.0015, unit="m", limits=(0.0, 0.2), doc="slow wander of each joint at rest"
    )
    wander_moving: float = parameter(
        0.030, unit="s", limits=(0.0, 0.5), doc="what a joint's speed adds to it, up to 0.8 m/s"
    )
    wander_time: float = parameter(
        0.4, unit="s", limits=(0.01, 10.0), doc="correlation time of the wander"
    )
    bone_stiffness: float = parameter(
        0.2, limits=(0.0, 1.0), doc="how far the tracker keeps a limb's length in its errors"
    )
    arm_likeness: float = parameter(
        0.8, limits=(0.0, 1.0), doc="how alike the errors of elbow and hand are"
    )
    hidden_error: float = parameter(
        0.08,
        unit="m",
        limits=(0.0, 1.0),
        doc="what a hidden joint's guess adds to the wander, 40 % of it at rest",
    )
    foreshortened_error: float = parameter(
        0.05,
        unit="m",
        limits=(0.0, 1.0),
        doc="what a limb that points to the sensor adds to the wander of its far joint",
    )
    inertia: float = parameter(
        0.5,
        limits=(0.0, 1.0),
        doc="how far a joint that is hard to see is drawn to where it was of late",
    )
    lag: float = parameter(
        0.04, unit="s", limits=(0.0, 0.5), doc="mean delay of the tracker's own smoothing"
    )
    own_lag: float = parameter(
        0.15,
        limits=(0.0, 1.0),
        doc="of what the joints' delays differ by, the part that is the sensor's own; 0: all the "
        "same as other sensors'",
    )
    glitch_rate: float = parameter(
        1.0, unit="1/min", limits=(0.0, 600.0), doc="short gross errors of each moving joint"
    )
    glitch_size: float = parameter(0.15, unit="m", limits=(0.0, 2.0), doc="their size")
    wrongly_tracked: float = parameter(
        0.25, limits=(0.0, 1.0), doc="share of hidden joints called tracked nevertheless"
    )
    lost_share: float = parameter(
        0.004, limits=(0.0, 0.9), doc="share of time in which a joint in view is not tracked"
    )
    hidden_lost_share: float = parameter(
        0.05, limits=(0.0, 0.9), doc="share of time in which a hidden joint is not tracked"
    )


_ERRORS = (
    "white_noise",
    "depth_noise",
    "joint_bias",
    "pose_bias",
    "flesh_offset",
    "wander_still",
    "wander_moving",
    "hidden_error",
    "foreshortened_error",
    "lag",
    "glitch_rate",
    "dropped_share",
    "lost_share",
    "hidden_lost_share",
)

TYPICAL = KinectParameters()
CLEAN = replace(
    TYPICAL,
    clock_drift=0.0,
    arrival_jitter=0.0,
    inertia=0.0,
    wrongly_tracked=0.0,
    **dict.fromkeys(_ERRORS, 0.0),
)
EASY = replace(
    TYPICAL,
    inertia=0.5 * TYPICAL.inertia,
    wrongly_tracked=0.5 * TYPICAL.wrongly_tracked,
    **{name: 0.5 * getattr(TYPICAL, name) for name in _ERRORS},
)
HARD = replace(
    TYPICAL,
    inertia=1.0,
    wrongly_tracked=0.5,
    **{name: 2.0 * getattr(TYPICAL, name) for name in _ERRORS},
)
PRESETS = {"clean": CLEAN, "easy": EASY, "typical": TYPICAL, "hard": HARD}
"""``clean``: no errors but hidden joints' states; ``easy``: half of ``typical``'s errors;
``typical``: a Kinect v2 with its own tracker; ``hard``: twice that, towards what is published of
Kinect v2 with NiTE2."""
