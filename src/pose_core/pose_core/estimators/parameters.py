"""Parameters of the pipeline, the same live and offline."""

from dataclasses import dataclass

from pose_core.baseline_filters.li2020 import Li2020Parameters
from pose_core.estimators import ESTIMATORS
from pose_core.parameters import NAME, parameter, sensors_parameter


@dataclass(frozen=True, kw_only=True)
class PipelineParameters(Li2020Parameters):
    """Parameters of the pipeline from samples to estimates."""

    estimator: str = parameter("default", choices=tuple(ESTIMATORS), doc="name of the estimator")
    body_model: str = parameter(
        "auto",
        doc="the kinematic tree: default, li2020, or the path of your own YAML file; auto: "
        "the one that the estimator was designed for",
    )
    subject: str = parameter("subject", doc="the person's id in topics and frames", pattern=NAME)
    person: str = parameter(
        "first",
        doc="the subject: `first` (also if empty), `nearest` (to the first sensor), `imus` (the"
        " wearer), or a sensor's id",
    )
    max_people: int = parameter(
        1, limits=(1, 6), doc="number of people to track, including the subject"
    )
    sensors: tuple[str, ...] = sensors_parameter()
    shape_duration: float = parameter(
        2.0,
        unit="s",
        limits=(0.2, 60.0),
        doc="duration of the samples from which bone lengths are measured",
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
        doc="rate of the published poses, which are predicted to the present; 0, and for "
        "estimators that cannot predict: one pose for each frame",
    )
    restart_after: float = parameter(
        0.5,
        unit="s",
        limits=(0.1, 10.0),
        doc="`li2020`, `joint_kf`, `dof_kf`: gap after which they restart",
    )
    restart_distance: float = parameter(
        0.3,
        unit="m",
        limits=(0.05, 2.0),
        doc="`li2020`: it restarts if the median joint is farther from its prediction for half a "
        "second",
    )
    use_imus: bool = parameter(True, doc="whether to use the IMUs, if there are any")
    forget_after: float = parameter(
        1.0,
        unit="s",
        limits=(0.1, 60.0),
        doc="silence of all sensors after which the default estimator restarts",
    )
    tracker_delay: float = parameter(
        0.0,
        unit="s",
        limits=(0.0, 0.2),
        doc="known delay of the Kinects' joints relative to their stamps; with IMUs it is the"
        " prior mean for the default estimator's estimate of each tracker's delay; 0: what the"
        " cameras' offsets tell, up to 0.1 s",
    )
    kinect_attitude_stddev: float = parameter(
        0.05,
        unit="rad",
        limits=(0.001, 1.0),
        doc="`zhang2015`: standard deviation σ₁ of a limb's attitude by the Kinect; with σ₂ "
        "it determines the weights, by default the paper's 0.8 and 0.2",
    )
    imu_attitude_stddev: float = parameter(
        0.1,
        unit="rad",
        limits=(0.001, 1.0),
        doc="`zhang2015`: standard deviation σ₂ of a limb's attitude by the IMU",
    )
