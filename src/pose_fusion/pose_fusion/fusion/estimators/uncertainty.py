"""What a filter's variances are worth: published are the ones that the errors then keep to.

A filter's covariance is that of its model. Three things are added: how well its expectations fit
these sensors and this person (the distances between what it expects and what it sees, against those
that go with covariances that are right); that the pose is late by something, so that quick joints
are further off; and that trackers mistake arms by more than legs. The numbers were fitted to the
errors of synthetic sessions, docs/algorithm.md says to which.
"""

from dataclasses import dataclass
from math import exp, isfinite

import numpy as np

from pose_fusion.body.model import BodyModel
from pose_fusion.fusion.estimators.estimator import FusedPose
from pose_fusion.kernels.reading import published_variance
from pose_fusion.streams.samples import FloatArray

MEMORY_S = 20.0  # [s] time constant
MOST = 20.0  # [-] a squared Mahalanobis distance that counts no more than that
RANGE = (0.2, 6.0)  # [-] of what the distances scale variances by


@dataclass(frozen=True, kw_only=True)
class Trust:
    """How a joint's published variance follows from the filter's: f d σ² + (T rate)² + s²."""

    factor: float = 1.0  # [-] f; d is the mean distance over the fitting one
    late_s: float = 0.0  # [s] T
    stddev_deg: float = 0.0  # s


# The mean squared distance that fits. It is below 3, the measurements' degrees of freedom, for the
# noise is enlarged to what slow errors leave of it.
FITTING = 0.55
KINECT = {
    "hip": Trust(factor=0.12, late_s=0.21),
    "knee": Trust(factor=0.85, late_s=0.07),
    "shoulder": Trust(factor=1.2, late_s=0.035, stddev_deg=1.1),
    "elbow": Trust(factor=3.8, late_s=0.03, stddev_deg=3.3),
}
WITH_IMU = {
    "hip": Trust(factor=0.17),
    "knee": Trust(factor=0.35),
    "shoulder": Trust(factor=2.7, stddev_deg=0.6),
    "elbow": Trust(factor=5.0),
}


class Uncertainty:
    """Published variances of one body's degrees of freedom.

    Args:
        model: The body model.
    """

    def __init__(self, model: BodyModel) -> None:
        self._distance = FITTING
        self._trusts = np.stack([_numbers(model, trusts) for trusts in (KINECT, WITH_IMU)])

    @property
    def distance(self) -> float:
        """Running mean of the squared Mahalanobis distances."""
        return self._distance

    def note(self, dt_s: float, distance: FloatArray) -> None:
        """Take the distances of one update's joints, shape (15,); NaN unseen."""
        known = [min(each, MOST) for each in distance.tolist() if isfinite(each)]
        if not known:
            return
        share = 1.0 - exp(-dt_s / MEMORY_S)
        self._distance += share * (sum(known) / len(known) - self._distance)

    def variance(self, pose: FusedPose, distance: float) -> FloatArray:
        """Of the degrees of freedom, (d,) [m²] or [rad²].

        Args:
            pose: As read off the filter.
            distance: The mean distance of its time.
        """
        least, most = RANGE
        scale = min(max(distance / FITTING, least), most)
        variance = np.empty_like(pose.variance)
        published_variance(
            pose.variance, pose.velocity, pose.weight_imu, scale, self._trusts, variance
        )
        return variance


def _numbers(model: BodyModel, trusts: dict[str, Trust]) -> FloatArray:
    """Factor, lateness [s] and deviation [rad], shape (3, d)."""
    own = [
        next((trust for joint, trust in trusts.items() if f"_{joint}_" in name), Trust())
        for name in model.dof_names
    ]
    return np.array([[t.factor, t.late_s, np.radians(t.stddev_deg)] for t in own], np.float64).T
