"""``mean``, ``left``, ``right``: the sensors' raw joints, without any filter."""

from typing import Any

import numpy as np

from pose_core.errors import ParameterError
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import FusedPose
from pose_core.estimators.estimator import StepwiseEstimator
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.pose_of_joints import PoseOfJoints
from pose_core.finite_numbers import nan_mean


class MeanOfSensors(StepwiseEstimator):
    """Mean of the sensors that measure a joint."""

    SENSOR = ""
    """The only sensor that is used; empty: all sensors."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._is_chosen = np.array([self.SENSOR in ("", each) for each in self.parameters.sensors])
        self._pose = PoseOfJoints(self.model, self.shape)

    @classmethod
    def check(cls, parameters: PipelineParameters) -> None:
        """Check that the sensor is among the sensors."""
        super().check(parameters)
        if cls.SENSOR and cls.SENSOR not in parameters.sensors:
            raise ParameterError(
                f"estimator = {cls.SENSOR} shows the sensor of that name, the sensors are "
                f"{', '.join(parameters.sensors)}: choose another estimator"
            )

    def update(self, observation: Observation) -> FusedPose | None:
        """Return the joints unfiltered; a joint that no sensor measures is NaN."""
        chosen = np.where(self._is_chosen[:, None, None], observation.positions, np.nan)
        is_measured = np.isfinite(chosen).all(axis=2)
        tracking_state = np.where(is_measured, observation.tracking_state, 0).max(axis=0)
        return self._pose.at(observation.stamp_ns, nan_mean(chosen), tracking_state)


class LeftSensor(MeanOfSensors):
    """Only the sensor named ``left``."""

    SENSOR = "left"


class RightSensor(MeanOfSensors):
    """Only the sensor named ``right``."""

    SENSOR = "right"
