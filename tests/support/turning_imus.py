"""Orientations and angular velocities of an IMU that rotates about changing axes."""

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.streams.samples import ImuBlock

PERIOD_S = 0.01
START_NS = 1_700_000_000_000_000_000


def turning(seconds, seed=1, speed=4.0):
    """A sensor that turns about changing axes: orientations and rates in its frame [rad/s]."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / PERIOD_S)) * PERIOD_S
    phase, frequency = rng.uniform(0.0, 6.0, (2, 3))
    rates = speed * np.sin(2.0 * np.pi * np.outer(t, 0.2 + 0.3 * frequency / 6.0) + phase)
    orientation, all_of = Rotation.random(random_state=seed), []
    for k in range(len(t)):
        all_of.append(orientation)
        if k + 1 < len(t):
            mean = 0.5 * (rates[k] + rates[k + 1])
            orientation = orientation * Rotation.from_rotvec(mean * PERIOD_S)
    return Rotation.concatenate(all_of), rates


def block(orientations, rates, segment="torso"):
    count = len(rates)
    return ImuBlock(
        segments=(segment,),
        imu=np.zeros(count, np.int64),
        stamps_ns=START_NS + np.arange(count) * round(PERIOD_S * 1e9),
        orientation=orientations.as_quat(),
        orientation_stddev=np.full((count, 3), 0.02),
        angular_velocity=rates,
        linear_acceleration=np.full((count, 3), np.nan),
    )


def changed(orientations, window, change):
    """The orientations with those of a window [samples] changed."""
    quaternions = orientations.as_quat()
    quaternions[window] = change(orientations[window]).as_quat()
    return Rotation.from_quat(quaternions)
