"""What a filter's variances are worth: published are the ones that the errors then keep to.

A filter's covariance is that of its model. Three things are added: how well its expectations fit
these sensors and this person (:mod:`pose_core.kernels.noise_scale`); that the pose is late by
something, so that quick joints are further off; and that trackers mistake arms by more than legs.
The numbers were fitted to the errors of synthetic sessions, docs/algorithm.md says to which.
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
        "hip": Trust(factor=0.2, late_s=0.21, stddev_deg=0.6),
        "knee": Trust(factor=0.6, late_s=0.1),
        "shoulder": Trust(factor=2.7, late_s=0.03, stddev_deg=1.0),
        "elbow": Trust(factor=4.5, late_s=0.2, stddev_deg=2.7),
    },
    with_imu={
        "hip": Trust(factor=0.13, late_s=0.2, stddev_deg=0.6),
        "knee": Trust(factor=0.2, late_s=0.03),
        "shoulder": Trust(factor=9.0, late_s=0.06),
        "elbow": Trust(factor=14.0, late_s=0.15, stddev_deg=0.3),
    },
)
LOOKING_AHEAD = Trusts(
    kinect={
        "hip": Trust(factor=0.35, late_s=0.15, stddev_deg=0.3),
        "knee": Trust(factor=0.7, late_s=0.1),
        "shoulder": Trust(factor=5.0, late_s=0.06, stddev_deg=1.0),
        "elbow": Trust(factor=12.0, late_s=0.2, stddev_deg=0.3),
    },
    with_imu={
        "hip": Trust(factor=0.28, late_s=0.15),
        "knee": Trust(factor=0.35, late_s=0.03),
        "shoulder": Trust(factor=13.0, late_s=0.06, stddev_deg=0.6),
        "elbow": Trust(factor=14.0, late_s=0.2, stddev_deg=0.6),
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
