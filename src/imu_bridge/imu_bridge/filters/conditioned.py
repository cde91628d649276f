"""Preprocessing for filters without it: gyroscope bias at rest, check of the magnetic field."""

from abc import abstractmethod

import numpy as np

from imu_bridge.filters.gyro_bias import RestBiasEstimator
from imu_bridge.filters.magnetic_field import FieldCheck
from imu_bridge.filters.orientation_filter import FilterSettings, OrientationFilter, SampleRound
from imu_bridge.filters.quaternions import rotate
from pose_core.arrays import FloatArray


class ConditionedFilter(OrientationFilter):
    """An :class:`OrientationFilter` with corrected rates and checked magnetic fields.

    Attributes:
        orientation: ``R_world_sensor`` as quaternions (x, y, z, w), shape (n, 4); NaN until the
            first usable acceleration.
    """

    def __init__(self, count: int, settings: FilterSettings) -> None:
        super().__init__(count, settings)
        self._bias = RestBiasEstimator(count, settings.gyro_bias_window)
        self.bias, self.rests = self._bias.bias, self._bias.rests
        self._field = FieldCheck(count)
        self.orientation: FloatArray = np.full((count, 4), np.nan)

    def reset(self, index: int) -> None:
        """See :class:`OrientationFilter`."""
        super().reset(index)
        self._bias.restart(index)
        self._field.reset(index)
        self.orientation[index] = np.nan

    def update(self, samples: SampleRound) -> FloatArray:
        """See :class:`OrientationFilter`."""
        index, dt = samples.index, samples.dt
        self._bias.update(index, dt, samples.angular_velocity, samples.acceleration)
        rate = samples.angular_velocity - self.bias[index]
        field = self._believed(samples, rate)
        q = self._advance(samples, rate, field)
        self.orientation[index] = q
        corrected = ~np.isnan(field[:, 0]) & ~np.isnan(q[:, 3])
        self._heading.update(index, dt, corrected)
        return q

    def _believed(self, samples: SampleRound, rate: FloatArray) -> FloatArray:
        """The accepted magnetic fields [T], shape (k, 3), NaN elsewhere."""
        field = self._offered_field(samples)
        if self._settings.magnetometer in ("off", "on"):
            return field
        index = samples.index
        q = self.orientation[index]
        fresh = np.isnan(q[:, 3])
        believed = self._field.update(
            index, samples.dt, rotate(q, field), np.linalg.norm(rate, axis=1)
        )
        believed |= fresh
        self.rejected[index] += ~believed & ~np.isnan(field[:, 0])
        return np.where(believed[:, None], field, np.nan)

    @abstractmethod
    def _advance(self, samples: SampleRound, rate: FloatArray, field: FloatArray) -> FloatArray:
        """One filter step with corrected rates and accepted fields; returns the orientations."""
