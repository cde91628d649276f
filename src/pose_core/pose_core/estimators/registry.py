"""The estimators by name.

Adding one means writing a module with a subclass of
:class:`pose_core.estimators.estimator.StepwiseEstimator`, and one line here. They are
named, not imported: parameters, which estimators read, take their choices from this table.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from pose_core.body.model import BodyModel, load_body_model

if TYPE_CHECKING:
    from pose_core.estimators.estimator import Estimator
    from pose_core.fusion.parameters import FusionParameters

ESTIMATORS: dict[str, str] = {
    "default": "segments.SegmentEstimator",
    "smoothed": "smoothed.SmoothedEstimator",
    "li2020": "li2020.Li2020Estimator",
    "joint_kf": "joint_kf.JointKalmanFilter",
    "dof_kf": "dof_kf.DofKalmanFilter",
    "mean": "raw.MeanOfSensors",
    "left": "raw.LeftSensor",
    "right": "raw.RightSensor",
    "imu": "imu.ImuEstimator",
}


def estimator_class(name: str) -> "type[Estimator]":
    """The class of an estimator, by one of :data:`ESTIMATORS`' names."""
    module, _, class_name = ESTIMATORS[name].partition(".")
    found: type[Estimator] = getattr(import_module(f"pose_core.estimators.{module}"), class_name)
    return found


def body_model_of(parameters: "FusionParameters") -> BodyModel:
    """The kinematic tree that the parameters name, or the one that their estimator was made for."""
    name = parameters.body_model
    return load_body_model(
        estimator_class(parameters.estimator).BODY_MODEL if name == "auto" else name
    )
