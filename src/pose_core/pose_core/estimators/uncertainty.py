"""What a filter's variances are worth: published are the ones that the errors then keep to.

A filter's covariance is that of its model. Three things are added: how well its expectations fit
these sensors and this person (:mod:`pose_core.kernels.noise_scale`); that the pose is late by
something, so that quick joints are further off; and what all cameras mistake alike, so that no
filter sees it: most of the error. The numbers were fitted to the errors on captured people,
docs/algorithm.md says to which.
"""

from dataclasses import dataclass

import numpy as np

from pose_core.body.model import BodyModel
from pose_core.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class VarianceCalibration:
    """How a joint's published variance follows from the filter's: f d σ² + (T rate)² + s²."""

    factor: float = 1.0  # [-] f; d is the mean distance over the fitting one
    late_s: float = 0.0  # [s] T
    stddev_deg: float = 0.0  # s


@dataclass(frozen=True, kw_only=True)
class VarianceCalibrations:
    """By kind of joint, without and with an IMU on its segments."""

    kinect: dict[str, VarianceCalibration]
    with_imu: dict[str, VarianceCalibration]


LIVE = VarianceCalibrations(
    kinect={
        "hip": VarianceCalibration(factor=1.0, late_s=0.016, stddev_deg=7.2),
        "knee": VarianceCalibration(factor=1.0, late_s=0.0065, stddev_deg=3.5),
        "shoulder": VarianceCalibration(factor=1.0, late_s=0.026, stddev_deg=6.8),
        "elbow": VarianceCalibration(factor=1.0, stddev_deg=2.2),
    },
    with_imu={
        "hip": VarianceCalibration(factor=1.0, late_s=0.026, stddev_deg=8.3),
        "knee": VarianceCalibration(factor=1.0, stddev_deg=4.9),
        "shoulder": VarianceCalibration(factor=1.0, stddev_deg=9.1),
        "elbow": VarianceCalibration(factor=1.7, stddev_deg=4.7),
    },
)
SMOOTHED = VarianceCalibrations(
    kinect={
        "hip": VarianceCalibration(factor=1.4, late_s=0.026, stddev_deg=8.2),
        "knee": VarianceCalibration(factor=3.4, late_s=0.0065, stddev_deg=1.3),
        "shoulder": VarianceCalibration(factor=1.0, late_s=0.046, stddev_deg=10),
        "elbow": VarianceCalibration(factor=2.4, stddev_deg=2.7),
    },
    with_imu={
        "hip": VarianceCalibration(factor=2.5, late_s=0.019, stddev_deg=7.7),
        "knee": VarianceCalibration(factor=2, stddev_deg=5.2),
        "shoulder": VarianceCalibration(factor=1.0, late_s=0.039, stddev_deg=9.9),
        "elbow": VarianceCalibration(factor=5.1, stddev_deg=2.7),
    },
)


def coefficients_of(model: BodyModel, calibrations: VarianceCalibrations) -> FloatArray:
    """Factor, lateness [s] and deviation [rad], by Kinects alone and with an IMU, (2, 3, d)."""
    return np.stack(
        [_coefficients(model, each) for each in (calibrations.kinect, calibrations.with_imu)]
    )


def _coefficients(model: BodyModel, calibrations: dict[str, VarianceCalibration]) -> FloatArray:
    """Factor, lateness [s] and deviation [rad], shape (3, d)."""
    own = [
        next(
            (calibration for joint, calibration in calibrations.items() if f"_{joint}_" in name),
            VarianceCalibration(),
        )
        for name in model.dof_names
    ]
    return np.array([[t.factor, t.late_s, np.radians(t.stddev_deg)] for t in own], np.float64).T
