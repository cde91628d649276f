"""Calibration of the variances: the published standard deviations match the actual errors.

The covariance of a filter covers only the errors of its model. Four corrections are made. The
normalised innovation squared scales the variance (:mod:`pose_core.estimators.variance_scale`), and
so do errors in depth (:func:`pose_core.filter.depth_errors.depth_variance_scale`). The pose has a
lag, so fast joints have a larger error. And the offsets that all cameras share, which no filter
observes, are the largest part of the error. The coefficients were fitted to the errors on captured
motion, before trackers of this repository and of others; docs/accuracy/README.md describes the
data.
"""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel

Coefficients = tuple[float, float, float]
"""f [-], T [s] and s [deg] of a joint's published variance, f d σ² + (T rate)² + s².

d is the mean NIS over its usual value, times the factor for errors in depth.
"""

UNCALIBRATED = (1.0, 0.0, 0.0)
POSITION = (1.0, 0.03, 0.012)  # of the root: f [-], T [s] and s [m]


@dataclass(frozen=True, kw_only=True)
class VarianceCalibrations:
    """Coefficients by kind of joint, without and with an IMU on its segments."""

    kinect: dict[str, Coefficients]
    with_imu: dict[str, Coefficients]


FILTERED = VarianceCalibrations(
    kinect={
        "hip_flexion": (0.7, 0.016, 4.3),
        "hip": (0.7, 0.016, 2.9),
        "knee": (0.6, 0.0065, 2.0),
        "shoulder_abduction": (0.8, 0.026, 5.7),
        "shoulder": (0.8, 0.026, 3.5),
        "elbow": (0.5, 0.0, 2.5),
    },
    with_imu={
        "hip_flexion": (1.0, 0.026, 4.5),
        "hip": (1.0, 0.026, 3.0),
        "knee": (1.0, 0.0, 1.9),
        "shoulder_abduction": (1.0, 0.0, 9.0),
        "shoulder": (1.0, 0.0, 6.5),
        "elbow": (1.0, 0.0, 2.7),
    },
)
SMOOTHED = VarianceCalibrations(
    kinect={
        "hip_flexion": (1.4, 0.026, 4.0),
        "hip": (1.4, 0.026, 3.0),
        "knee": (2.2, 0.0065, 0.0),
        "shoulder_abduction": (1.0, 0.046, 7.5),
        "shoulder": (1.0, 0.046, 6.5),
        "elbow": (1.4, 0.0, 0.7),
    },
    with_imu={
        "hip_flexion": (2.2, 0.019, 4.5),
        "hip": (2.2, 0.019, 2.5),
        "knee": (1.8, 0.0, 0.7),
        "shoulder_abduction": (1.0, 0.039, 8.0),
        "shoulder": (1.0, 0.039, 6.5),
        "elbow": (2.7, 0.0, 1.2),
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


def _coefficients(model: BodyModel, calibrations: dict[str, Coefficients]) -> FloatArray:
    """Coefficients f [-], T [s], s [rad] of each degree of freedom, shape (3, d)."""
    coefficients = [
        next((own for joint, own in calibrations.items() if f"_{joint}_" in name), UNCALIBRATED)
        for name in model.dof_names
    ]
    factor, late_s, stddev_deg = np.array(coefficients).T
    calibrated = np.stack([factor, late_s, np.radians(stddev_deg)])
    calibrated[:, :3] = np.array(POSITION)[:, None]
    return calibrated
