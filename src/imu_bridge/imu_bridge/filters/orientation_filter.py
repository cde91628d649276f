"""Interface of the orientation filters."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray

IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

MAGNETOMETER_MODES = ("start", "auto", "on", "off")
"""``start``: initial heading only; ``auto``: undisturbed fields; ``on``: all; ``off``: none."""
UNKNOWN_HEADING = np.pi  # [rad] standard deviation of an unknown heading


@dataclass(frozen=True, kw_only=True)
class FilterSettings:
    """Settings of the user; each filter uses some of them."""

    magnetometer: str = "auto"  # one of MAGNETOMETER_MODES
    beta: float = 0.1  # [rad/s] Madgwick's gain
    gain: float = 0.1  # [-] imufusion's gain
    acceleration_tau: float = 1.5  # [s] VQF's low-pass on the acceleration
    magnetometer_tau: float = 10.0  # [s] VQF's time constant of the heading
    gyro_bias_window: float = 2.0  # [s] of rest to estimate the gyroscope's bias; 0: no estimation
    heading_stddev: float = 0.12  # [rad] while an undisturbed field corrects the heading
    heading_drift: float = 0.002  # [rad/s] its growth otherwise


@dataclass(frozen=True, kw_only=True)
class SampleRound:
    """One sample each of k different sensors.

    Attributes:
        index: Indices of the sensors, shape (k,), without repetition.
        dt: Time since each one's previous sample [s], shape (k,); 0 for its first.
        angular_velocity: [rad/s] in sensor axes, finite, shape (k, 3).
        acceleration: Specific force [m/s^2], shape (k, 3); zero if missing.
        magnetic_field: [T], shape (k, 3); NaN where there is no new one.
        device_orientation: The sensors' own (x, y, z, w), shape (k, 4); NaN if missing.
    """

    index: IndexArray
    dt: FloatArray
    angular_velocity: FloatArray
    acceleration: FloatArray
    magnetic_field: FloatArray
    device_orientation: FloatArray


class OrientationFilter(Protocol):
    """Orientations of n sensors, each advanced by its own samples.

    Attributes:
        bias: The gyroscopes' estimated bias [rad/s], shape (n, 3).
        rests: Number of rests used for it, shape (n,).
        heading_stddev: [rad], shape (n,); :data:`UNKNOWN_HEADING` where only z up is known.
        rejected: Number of rejected magnetometer samples, shape (n,).
    """

    bias: FloatArray
    rests: NDArray[np.int64]
    heading_stddev: FloatArray
    rejected: NDArray[np.int64]

    def reset(self, index: int) -> None:
        """Reset one sensor's orientation; its next sample initialises it."""

    def update(self, samples: SampleRound) -> FloatArray:
        """Advance k sensors by one sample each.

        Returns:
            ``R_world_sensor`` of each as (x, y, z, w), shape (k, 4); NaN before the first usable
            acceleration. World: z up; y magnetic north where the heading is known.
        """
