"""Madgwick's filter alone, and single steps of it."""

import numpy as np

from imu_bridge.filters.madgwick import MadgwickOrientation
from imu_bridge.filters.orientation_filter import FilterSettings, SampleRound


def make_filter(count: int, beta: float) -> MadgwickOrientation:
    """The filter without preprocessing."""
    settings = FilterSettings(beta=beta, magnetometer="on", gyro_bias_window=0.0)
    return MadgwickOrientation(count, settings)


def advance(filter_, index, dt, rate, acceleration, field) -> np.ndarray:
    return filter_.update(
        SampleRound(
            index=index,
            dt=dt,
            angular_velocity=rate,
            acceleration=acceleration,
            magnetic_field=field,
            device_orientation=np.full((len(index), 4), np.nan),
        )
    )
