"""Base of the orientation filters: their settings, their samples and what they estimate."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imu_bridge.filters.heading import HeadingUncertainty
from pose_core.arrays import FloatArray
from pose_core.parameters import parameter

IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

MAGNETOMETER_MODES = ("start", "auto", "on", "off")
"""``start``: initial heading only; ``auto``: undisturbed fields; ``on``: all; ``off``: none."""
START_S = 10.0  # [s] after a sensor's first sample: averages the noise, with little drift


@dataclass(frozen=True, kw_only=True)
class FilterSettings:
    """Parameters of the filters; each filter uses some of them."""

    magnetometer: str = parameter(
        "auto",
        choices=MAGNETOMETER_MODES,
        doc="`start`: sets the initial heading, then only the gyroscope; `auto`: also later, "
        "while the field looks like the earth's; `on`: always; `off`: never",
    )
    acceleration_tau: float = parameter(
        1.5,
        unit="s",
        limits=(0.05, 60.0),
        doc="`vqf`: time constant of the correction of the inclination",
    )
    magnetometer_tau: float = parameter(
        10.0,
        unit="s",
        limits=(0.05, 600.0),
        doc="`vqf`: time constant of the correction of the heading",
    )
    beta: float = parameter(
        0.1,
        unit="rad/s",
        limits=(0.0, 10.0),
        doc="`madgwick`: gain of the accelerometer and magnetometer",
    )
    gain: float = parameter(
        0.1, limits=(0.0, 10.0), doc="`imufusion`: gain of the accelerometer and magnetometer"
    )
    gyro_bias_window: float = parameter(
        2.0,
        unit="s",
        limits=(0.0, 60.0),
        doc="time at rest after which the gyroscope's bias is estimated; 0: no estimate",
    )
    heading_stddev: float = parameter(
        0.12,
        unit="rad",
        limits=(1e-4, 3.2),
        doc="published uncertainty of a heading that an undisturbed magnetic field corrects",
    )
    heading_drift: float = parameter(
        0.002,
        unit="rad/s",
        limits=(0.0, 1.0),
        doc="growth of that uncertainty while no field corrects it",
    )


@dataclass(frozen=True, kw_only=True)
class SampleRound:
    """One sample each of k different sensors, in their own axes."""

    index: IndexArray  # (k,) of the sensors, without repetition
    dt: FloatArray  # (k,) [s] since each one's previous sample; 0 for its first
    angular_velocity: FloatArray  # (k, 3) [rad/s], finite
    acceleration: FloatArray  # (k, 3) [m/s^2] specific force; zero if missing
    magnetic_field: FloatArray  # (k, 3) [T]; NaN where there is no new one
    device_orientation: FloatArray  # (k, 4) the sensors' own (x, y, z, w); NaN if missing


class OrientationFilter(ABC):
    """Orientations of n sensors, each advanced by its own samples.

    Args:
        count: The number n of sensors.
        settings: The user's settings.

    Attributes:
        bias: The gyroscopes' estimated bias [rad/s], shape (n, 3).
        rests: Number of rests used for it, shape (n,).
        heading_stddev: [rad], shape (n,); :data:`UNKNOWN_HEADING` where only z up is known.
        rejected: Number of rejected magnetometer samples, shape (n,).
    """

    def __init__(self, count: int, settings: FilterSettings) -> None:
        self.bias: FloatArray = np.zeros((count, 3))
        self.rests: NDArray[np.int64] = np.zeros(count, dtype=int)
        self.rejected: NDArray[np.int64] = np.zeros(count, dtype=int)
        self._settings = settings
        self._heading = HeadingUncertainty(count, settings.heading_stddev, settings.heading_drift)
        self.heading_stddev = self._heading.stddev
        self._since_s = np.zeros(count)  # [s] since each sensor's first sample

    def reset(self, index: int) -> None:
        """Reset one sensor's orientation; its next sample initialises it."""
        self._heading.reset(index)
        self._since_s[index] = 0.0

    @abstractmethod
    def update(self, samples: SampleRound) -> FloatArray:
        """Advance k sensors by one sample each.

        Returns:
            ``R_world_sensor`` of each as (x, y, z, w), shape (k, 4); NaN before the first usable
            acceleration. World: z up; y magnetic north where the heading is known.
        """

    def _offered_field(self, samples: SampleRound) -> FloatArray:
        """The magnetic fields [T] that the mode selects, shape (k, 3), NaN elsewhere.

        A heading that is set once drifts slowly and steadily with the gyroscope's remaining bias,
        which cameras can correct. A heading that is corrected by the field all the time is
        disturbed by iron near the sensor.
        """
        longest_s = {"off": -1.0, "start": START_S}.get(self._settings.magnetometer, np.inf)
        self._since_s[samples.index] += samples.dt
        is_offered = self._since_s[samples.index] <= longest_s
        return np.where(is_offered[:, None], samples.magnetic_field, np.nan)
