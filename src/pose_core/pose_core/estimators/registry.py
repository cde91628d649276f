"""Lookup of the estimators' classes by name, imported on demand."""

from importlib import import_module

from pose_core.body.model import BodyModel, load_body_model
from pose_core.estimators import ESTIMATORS
from pose_core.estimators.estimator import Estimator
from pose_core.estimators.parameters import PipelineParameters


def estimator_class(name: str) -> type[Estimator]:
    """The class of an estimator, by one of :data:`ESTIMATORS`' names."""
    module, _, class_name = ESTIMATORS[name].partition(".")
    found: type[Estimator] = getattr(import_module(f"pose_core.estimators.{module}"), class_name)
    return found


def body_model_of(parameters: PipelineParameters) -> BodyModel:
    """The body model in the parameters, or the one that their estimator was designed for."""
    name = parameters.body_model
    return load_body_model(
        estimator_class(parameters.estimator).BODY_MODEL if name == "auto" else name
    )
