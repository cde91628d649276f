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
class Trust:
    """How a joint's published variance follows from the filter's: f d σ² + (T rate)² + s²."""

    factor: float = 1.0  # [-] f; d is the mean distance over the fitting one
    late_s: float = 0.0  # [s] T
    stddev_deg: float = 0.0  # s


@dataclass(frozen=True, kw_only=True)
class Trusts:
    """By kind of joint, without and with an IMU on its segments."""

    kinect: dict[str, Trust]
    with_imu: dict[str, Trust]


LIVE = Trusts(
    kinect={
        "hip": Trust(factor=1.0, late_s=0.016, stddev_deg=7.2),
        "knee": Trust(factor=1.0, late_s=0.0065, stddev_deg=3.5),
        "shoulder": Trust(factor=1.0, late_s=0.026, stddev_deg=6.8),
        "elbow": Trust(factor=1.0, stddev_deg=2.2),
    },
    with_imu={
        "hip": Trust(factor=1.0, late_s=0.026, stddev_deg=8.3),
        "knee": Trust(factor=1.0, stddev_deg=4.9),
        "shoulder": Trust(factor=1.0, stddev_deg=9.1),
        "elbow": Trust(factor=1.7, stddev_deg=4.7),
    },
)
LOOKING_AHEAD = Trusts(
    kinect={
        "hip": Trust(factor=1.4, late_s=0.026, stddev_deg=8.2),
        "knee": Trust(factor=3.4, late_s=0.0065, stddev_deg=1.3),
        "shoulder": Trust(factor=1.0, late_s=0.046, stddev_deg=10),
        "elbow": Trust(factor=2.4, stddev_deg=2.7),
    },
    with_imu={
        "hip": Trust(factor=2.5, late_s=0.019, stddev_deg=7.7),
        "knee": Trust(factor=2, stddev_deg=5.2),
        "shoulder": Trust(factor=1.0, late_s=0.039, stddev_deg=9.9),
        "elbow": Trust(factor=5.1, stddev_deg=2.7),
    },
)


def numbers_of(model: BodyModel, trusts: Trusts) -> FloatArray:
    """Factor, lateness [s] and deviation [rad], by Kinects alone and with an IMU, (2, 3, d)."""
    return np.stack([_numbers(model, each) for each in (trusts.kinect, trusts.with_imu)])


def _numbers(model: BodyModel, trusts: dict[str, Trust]) -> FloatArray:
    """Factor, lateness [s] and deviation [rad], shape (3, d)."""
    own = [
        next((trust for joint, trust in trusts.items() if f"_{joint}_" in name), Trust())
        for name in model.dof_names
    ]
    return np.array([[t.factor, t.late_s, np.radians(t.stddev_deg)] for t in own], np.float64).T
