"""What a user may set of the fusion, live and offline alike."""

from dataclasses import dataclass

from pose_core.baseline_filters.li2020 import Li2020Parameters
from pose_core.estimators import ESTIMATORS
from pose_core.parameters import NAME, NAME_ENDING, RUN, parameter


@dataclass(frozen=True, kw_only=True)
class FusionParameters(Li2020Parameters):
    """Parameters of the whole chain from samples to estimates."""

    estimator: str = parameter(
        "default", choices=tuple(ESTIMATORS), doc="how the pose is estimated"
    )
    body_model: str = parameter(
        "auto",
        doc="the kinematic tree: default, li2020, or the path of a YAML file of your own; auto: "
        "the one that the estimator was made for",
    )
    subject: str = parameter("subject", doc="the person's id in topics and frames", pattern=NAME)
    person: str = parameter(
        "first",
        doc="the subject: `first`, `nearest` (to the first sensor), `imus` (who wears them), or "
        "a sensor's id",
    )
    max_people: int = parameter(
        1, limits=(1, 6), doc="how many people's poses are estimated, the subject first"
    )
    sensors: tuple[str, ...] = parameter(
        ("left", "right"), doc="names of the Kinects", pattern=NAME_ENDING
    )
    extrinsics_file: str = parameter("", doc="YAML of the calibration; empty: from /tf_static")
    imus_file: str = parameter(
        "",
        doc="YAML of the session whose `imus` say how the IMUs sit; empty: `extrinsics_file`; "
        "where there are none: found from motion",
    )
    shape_file: str = parameter(
        "", doc="YAML of the bone lengths: read if it exists, else measured and saved there"
    )
    run: str = parameter(
        "",
        doc="the graph's run: a node that is started again within it goes on with what it had "
        "found out; empty: it begins anew",
        pattern=RUN,
    )
    shape_duration: float = parameter(
        2.0, unit="s", limits=(0.2, 60.0), doc="stretch of samples that bone lengths come from"
    )
    max_skew: float = parameter(
        0.02,
        unit="s",
        limits=(0.001, 0.1),
        doc="baselines: largest difference of stamps in a pair of frames",
    )
    max_gap: float = parameter(
        0.1,
        unit="s",
        limits=(0.02, 1.0),
        doc="baselines: longest gap of one sensor to interpolate across",
    )
    max_wait: float = parameter(
        0.2, unit="s", limits=(0.05, 2.0), doc="baselines: longest silence of a sensor to wait for"
    )
    output_rate: float = parameter(
        100.0,
        unit="Hz",
        limits=(0.0, 240.0),
        doc="rate at which the pose is predicted to now and published; 0, and of estimators that "
        "cannot predict: once for each frame",
    )
    restart_after: float = parameter(
        0.5, unit="s", limits=(0.1, 10.0), doc="baselines: gap after which the filter starts anew"
    )
    restart_distance: float = parameter(
        0.3,
        unit="m",
        limits=(0.05, 2.0),
        doc="baselines: a median joint that far from its prediction for half a second restarts "
        "the filter",
    )
    use_imus: bool = parameter(True, doc="weight the IMUs in, where there are any")
    imu_wait: float = parameter(
        0.1,
        unit="s",
        limits=(0.0, 0.5),
        doc="baselines: longest wait for an IMU's sample of an instant",
    )
    forget_after: float = parameter(
        1.0,
        unit="s",
        limits=(0.1, 60.0),
        doc="silence of all sensors after which the default estimator looks anew",
    )
    tracker_delay: float = parameter(
        0.0,
        unit="s",
        limits=(0.0, 0.2),
        doc="how late the Kinects' joints are against their stamps, as far as it is known; with "
        "IMUs the default estimator seeks each tracker's delay around it",
    )
    kinect_attitude_stddev: float = parameter(
        0.05,
        unit="rad",
        limits=(0.001, 1.0),
        doc="`zhang2015`: σ₁ of a limb's attitude as the Kinect has it; with σ₂ it gives the "
        "weights, by default the paper's 0.8 and 0.2",
    )
    imu_attitude_stddev: float = parameter(
        0.1,
        unit="rad",
        limits=(0.001, 1.0),
        doc="`zhang2015`: σ₂ of a limb's attitude as its IMU has it",
    )
