"""VQF: orientation with bias estimation and rejection of magnetic disturbances.

The bias is estimated at rest, and in motion until the first rest. The library's C++ code runs one
filter per sensor; this module adapts it to unknown sampling rates and lost samples.

References:
    Laidig, Seel (2023), Information Fusion 91, doi:10.1016/j.inffus.2022.10.014.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vqf import VQF

from imu_bridge.filters.gyro_bias import REST_RATE_MEAN
from imu_bridge.filters.orientation_filter import FilterSettings, OrientationFilter, SampleRound
from pose_core.arrays import FloatArray

FIRST_PERIOD_S = 0.01  # [s] assumed after a sensor's first sample
PERIOD_TOLERANCE = 0.05  # [-] accepted difference between a sensor's period and the filter's
PERIOD_MIN_S = 0.0005  # [s] faster samples are several delivered at once
REPLAYS = (4, 16, 64)  # [-] counts of samples after which the period is checked
NEW_BIAS_STDDEV = np.radians(1.0)  # [rad/s] of a low-cost sensor before its first rest
KNOWN_BIAS_STDDEV = np.radians(0.5)  # [rad/s] after it: VQF's default
REST_END_S = 1.0  # [s] in which VQF may mistake slow motion for rest
BIAS_FOUND_S = 0.5  # [s] of rest that VQF needs for the bias
GRAVITY_MIN = 1e-3  # [m/s^2] smaller accelerations count as missing

Sample = tuple[float, FloatArray, FloatArray, FloatArray | None]


@dataclass(kw_only=True)
class _Sensor:
    """One sensor's filter, and its first samples until its period is known."""

    vqf: Any
    period_s: float
    first: list[Sample] = field(default_factory=list)
    rate_before: FloatArray = field(default_factory=lambda: np.zeros(3))
    was_resting: bool = False
    rest_biases: deque[FloatArray] = field(init=False)  # per sample, at the end of a rest

    def __post_init__(self) -> None:
        kept_s = BIAS_FOUND_S + REST_END_S
        self.rest_biases = deque(maxlen=max(1, round(kept_s / self.period_s)))


class VqfOrientation(OrientationFilter):
    """An :class:`OrientationFilter` with one VQF per sensor."""

    def __init__(self, count: int, settings: FilterSettings) -> None:
        super().__init__(count, settings)
        self._sensors: list[_Sensor | None] = [None] * count
        self._verified: NDArray[np.bool_] = np.zeros(count, dtype=bool)

    def reset(self, index: int) -> None:
        """See :class:`OrientationFilter`."""
        super().reset(index)
        self._sensors[index] = None
        self._verified[index] = False

    def update(self, samples: SampleRound) -> FloatArray:
        """See :class:`OrientationFilter`."""
        orientation = np.full((len(samples.index), 4), np.nan)
        corrected = np.zeros(len(samples.index), dtype=bool)
        field = self._offered_field(samples)
        has_field = ~np.isnan(field[:, 0])
        # The library filters one sensor at a time.
        for row, (i, dt) in enumerate(
            zip(samples.index.tolist(), samples.dt.tolist(), strict=True)
        ):
            magnetic = field[row] if has_field[row] else None
            sample = (dt, samples.angular_velocity[row], samples.acceleration[row], magnetic)
            sensor = self._sensors[i]
            if sensor is None:
                if np.abs(sample[2]).max() < GRAVITY_MIN:
                    continue
                sensor = self._sensors[i] = self._begin(i, FIRST_PERIOD_S, [])
            sensor = self._advance(i, sensor, sample)
            orientation[row] = sensor.vqf.getQuat9D()
            corrected[row] = has_field[row] and self._believes(i, sensor)
        self._heading.update(samples.index, samples.dt, corrected)
        return orientation[:, [1, 2, 3, 0]]

    def _advance(self, i: int, sensor: _Sensor, sample: Sample) -> _Sensor:
        """Process a sample; returns the sensor, a new one if its period has changed."""
        if len(sensor.first) < REPLAYS[-1]:
            sensor.first.append(sample)
            if len(sensor.first) in REPLAYS:
                # The mean, since samples that arrived together have no time between them.
                mean_s = sum(dt for dt, *_ in sensor.first[1:]) / (len(sensor.first) - 1)
                period_s = max(mean_s, PERIOD_MIN_S)
                if abs(period_s / sensor.period_s - 1.0) > PERIOD_TOLERANCE:
                    sensor = self._sensors[i] = self._begin(i, period_s, sensor.first)
                    return sensor
        _feed(sensor, sample)
        self._update_bias(i, sensor)
        return sensor

    def _begin(self, i: int, period_s: float, first: list[Sample]) -> _Sensor:
        s = self._settings
        vqf = VQF(
            period_s,
            tauAcc=s.acceleration_tau,
            tauMag=s.magnetometer_tau,
            magDistRejectionEnabled=s.magnetometer != "on",
            motionBiasEstEnabled=s.gyro_bias_window > 0.0 and not self.rests[i],
            restBiasEstEnabled=s.gyro_bias_window > 0.0,
            biasClip=float(np.degrees(REST_RATE_MEAN)),
            restMinT=s.gyro_bias_window if s.gyro_bias_window > 0.0 else 1.5,
        )
        stddev = KNOWN_BIAS_STDDEV if self.rests[i] else NEW_BIAS_STDDEV
        vqf.setBiasEstimate(np.ascontiguousarray(self.bias[i]), stddev)  # kept across a reset
        sensor = _Sensor(vqf=vqf, period_s=period_s, first=first)
        for sample in first:
            _feed(sensor, sample)
        return sensor

    def _update_bias(self, i: int, sensor: _Sensor) -> None:
        """Take over the bias; after the first rest, have VQF estimate it at rest only."""
        if self._settings.gyro_bias_window <= 0.0:
            return
        resting = bool(sensor.vqf.getRestDetected())
        if sensor.was_resting and not resting:
            sensor.vqf.setBiasEstimate(_before_motion(sensor))
            sensor.rest_biases.clear()
        self.bias[i] = sensor.vqf.getBiasEstimate()[0]
        if resting:
            sensor.rest_biases.append(self.bias[i].copy())
            # From now on the bias is estimated at rest only: the estimate in motion of the vertical
            # axis drifts by some tenths of a degree per second in a quarter of an hour.
            sensor.vqf.setMotionBiasEstEnabled(False)
        self.rests[i] += resting and not sensor.was_resting
        sensor.was_resting = resting

    def _believes(self, i: int, sensor: _Sensor) -> bool:
        """Whether the filter currently corrects the heading by the magnetic field."""
        if self._settings.magnetometer == "on":
            return True
        disturbed = bool(sensor.vqf.getMagDistDetected())
        self._verified[i] |= not disturbed
        # Before VQF has a reference field it uses any field.
        rejects = disturbed and bool(self._verified[i])
        self.rejected[i] += rejects
        return not rejects


def _before_motion(sensor: _Sensor) -> FloatArray:
    """The bias before the last second of a rest, in which slow motion shifts it by 0.2 deg/s."""
    found = round(BIAS_FOUND_S / sensor.period_s)
    return sensor.rest_biases[min(found, len(sensor.rest_biases) - 1)]


def _feed(sensor: _Sensor, sample: Sample) -> None:
    """Pass one sample to the filter, so that it integrates the rate over the true time step."""
    dt, rate, acceleration, magnetic = sample
    vqf = sensor.vqf
    if dt > 0.0:
        steps = max(1, round(dt / sensor.period_s))
        scale = dt / (steps * sensor.period_s)
        for k in range(1, steps + 1):  # more than one after lost samples
            between = sensor.rate_before + (rate - sensor.rate_before) * (k / steps)
            vqf.updateGyr(np.ascontiguousarray(between * scale))
    sensor.rate_before = rate
    vqf.updateAcc(np.ascontiguousarray(acceleration))
    if magnetic is not None:
        vqf.updateMag(np.ascontiguousarray(magnetic))
