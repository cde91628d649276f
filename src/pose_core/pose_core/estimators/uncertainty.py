"""Calibration of the variances: the published standard deviations match the actual errors.

The covariance of a filter covers only the errors of its model. Three corrections are made. The
normalised innovation squared scales the variance (:mod:`pose_core.kernels.noise_scale`). The pose
has a lag, so fast joints have a larger error. And the offsets that all cameras share, which no
filter observes, are the largest part of the error. The coefficients were fitted to the errors on
captured motion; docs/accuracy/README.md describes the data.
"""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel


@dataclass(frozen=True, kw_only=True)
class VarianceCalibration:
    """Coefficients of a joint's published variance: f d σ² + (T rate)² + s²."""

    factor: float = 1.0  # [-] f; d is the mean NIS over its usual value
    late_s: float = 0.0  # [s] T
    stddev_deg: float = 0.0  # [deg] s


@dataclass(frozen=True, kw_only=True)
class VarianceCalibrations:
    """Coefficients by kind of joint, without and with an IMU on its segments."""

    kinect: dict[str, VarianceCalibration]
    with_imu: dict[str, VarianceCalibration]


LIVE = VarianceCalibrations(
    kinect={
        "hip_flexion": VarianceCalibration(factor=0.7, late_s=0.016, stddev_deg=3.5),
        "hip": VarianceCalibration(factor=0.7, late_s=0.016, stddev_deg=1.5),
        "knee": VarianceCalibration(factor=0.6, late_s=0.0065),
        "shoulder_abduction": VarianceCalibration(factor=0.8, late_s=0.026, stddev_deg=4.0),
        "shoulder": VarianceCalibration(factor=0.8, late_s=0.026, stddev_deg=2.5),
        "elbow": VarianceCalibration(factor=0.5),
    },
    with_imu={
        "hip_flexion": VarianceCalibration(late_s=0.026, stddev_deg=4.5),
        "hip": VarianceCalibration(late_s=0.026, stddev_deg=3.0),
        "knee": VarianceCalibration(stddev_deg=3.6),
        "shoulder_abduction": VarianceCalibration(stddev_deg=8.0),
        "shoulder": VarianceCalibration(stddev_deg=6.5),
        "elbow": VarianceCalibration(factor=1.1, stddev_deg=3.6),
    },
)
SMOOTHED = VarianceCalibrations(
    kinect={
        "hip_flexion": VarianceCalibration(factor=1.4, late_s=0.026, stddev_deg=4.0),
        "hip": VarianceCalibration(factor=1.4, late_s=0.026, stddev_deg=3.0),
        "knee": VarianceCalibration(factor=2.2, late_s=0.0065),
        "shoulder_abduction": VarianceCalibration(late_s=0.046, stddev_deg=7.5),
        "shoulder": VarianceCalibration(late_s=0.046, stddev_deg=6.5),
        "elbow": VarianceCalibration(factor=1.4, stddev_deg=0.7),
    },
    with_imu={
        "hip_flexion": VarianceCalibration(factor=2.2, late_s=0.019, stddev_deg=4.5),
        "hip": VarianceCalibration(factor=2.2, late_s=0.019, stddev_deg=2.5),
        "knee": VarianceCalibration(factor=2.0, stddev_deg=3.2),
        "shoulder_abduction": VarianceCalibration(late_s=0.039, stddev_deg=8.0),
        "shoulder": VarianceCalibration(late_s=0.039, stddev_deg=6.5),
        "elbow": VarianceCalibration(factor=3.3, stddev_deg=2.5),
    },
)
"""Of a degree of freedom, the first whose name is part of its name counts."""


def coefficients_of(model: BodyModel, calibrations: VarianceCalibrations) -> FloatArray:
    """Coefficients f [-], T [s], s [rad] of each degree of freedom.

    Returns:
        Without and with an IMU, shape (2, 3, d).
    """
    return np.stack(
        [_coefficients(model, each) for each in (calibrations.kinect, calibrations.with_imu)]
    )


def _coefficients(model: BodyModel, calibrations: dict[str, VarianceCalibration]) -> FloatArray:
    """Coefficients f [-], T [s], s [rad] of each degree of freedom, shape (3, d)."""
    own = [
        next(
            (calibration for joint, calibration in calibrations.items() if f"_{joint}_" in name),
            VarianceCalibration(),
        )
        for name in model.dof_names
    ]
    return np.array([[t.factor, t.late_s, np.radians(t.stddev_deg)] for t in own], np.float64).T
