"""Parameters of the pipeline, the same live and offline."""

from dataclasses import dataclass

from pose_core.estimators import ESTIMATORS
from pose_core.parameters import NAME, parameter, sensors_parameter


@dataclass(frozen=True, kw_only=True)
class PipelineParameters:
    """Parameters of the pipeline from samples to estimates."""

    estimator: str = parameter("default", choices=tuple(ESTIMATORS), doc="name of the estimator")
    body_model: str = parameter(
        "auto",
        doc="the kinematic tree: default, li2020, or the path of your own YAML file; auto: "
        "the one that the estimator was designed for",
    )
    tuning: str = parameter(
        "",
        doc="path of a YAML file with other tuning parameters of the default filter; empty: none",
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
        doc="least duration of the samples from which bone lengths are measured",
    )
    output_rate: float = parameter(
        100.0,
        unit="Hz",
        limits=(0.0, 240.0),
        doc="rate of the published poses, which are predicted to the present; 0, and for "
        "estimators that cannot predict: one pose for each frame",
    )
    use_imus: bool = parameter(True, doc="whether to use the IMUs, if there are any")
    forget_after: float = parameter(
        1.0,
        unit="s",
        limits=(0.1, 60.0),
        doc="silence of all sensors after which the default estimator restarts, and of the cameras"
        " after which few IMUs give no pose",
    )
    tracker_delay: float = parameter(
        0.0,
        unit="s",
        limits=(0.0, 0.2),
        doc="known delay of the Kinects' joints relative to their stamps; with IMUs it is the"
        " prior mean for the default estimator's estimate of each tracker's delay; 0: not"
        " known, taken from the offsets between the cameras, up to 45 ms; known to be none: 0.001",
    )
