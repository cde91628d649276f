"""Virtual IMUs on captured people: orientations with misalignment, drift and noise."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation, Slerp

from pose_core.arrays import FloatArray
from pose_sim.captured.clip import RATE, Clip
from pose_sim.tracker_errors import slow_process
from pose_sim.virtual_imu import NODES

NINE = tuple(NODES.values())
"""Segments of nine IMUs."""
SWING_S = 5.0  # [s] correlation time of a heading in an uneven magnetic field
DIFFERENCE_S = 0.004  # [s] over which angular velocities are computed


@dataclass(frozen=True, kw_only=True)
class ImuModel:
    """One kind of IMU and how it is worn; sizes are standard deviations."""

    rates: tuple[float, ...] = (100.0,)  # [Hz] of the first segment, the second, …, and again
    crooked: float = 0.44  # [rad] largest misalignment with the source's segment axes
    field: float = 0.25  # [rad] of each IMU's heading about the common one
    heading_walk: float = 0.0015  # [rad/√s]
    has_magnetometer: bool = True  # otherwise headings are unknown, and drift
    drift: float = 0.005  # [rad/s] of the heading without a magnetometer
    disturbance: float = 0.0  # [rad] by which each heading swings where fields are uneven
    tilt: float = 0.015  # [rad], slowly changing
    soft_tissue: float = 0.03  # [rad] in motion of 3 rad/s
    gyro_bias: float = 0.01  # [rad/s]

    @property
    def orientation_stddev(self) -> FloatArray:
        """What the IMU states, (3,) [rad]: tilt twice, heading."""
        return np.array([0.02, 0.02, 0.2 if self.has_magnetometer else np.pi])


@dataclass(frozen=True, kw_only=True)
class ImuStream:
    """Samples of one IMU, n of them."""

    segment: str
    stamps_s: FloatArray  # (n,) [s]
    orientation: FloatArray  # (n, 4) quaternion x, y, z, w: world from sensor
    angular_velocity: FloatArray  # (n, 3) [rad/s] in the sensor's frame


def wear(
    clip: Clip, model: ImuModel, rng: np.random.Generator, segments: Sequence[str] = NINE
) -> list[ImuStream]:
    """Simulate the IMUs of a motion; segments that the clip lacks are left out."""
    north = rng.uniform(-np.pi, np.pi)
    return [
        _stream(clip.rotations[segment], segment, north, model, rate_hz, rng)
        for segment, rate_hz in zip(segments, cycle(model.rates))
        if segment in clip.rotations
    ]


def _stream(
    rotation: Rotation,
    segment: str,
    north: float,
    model: ImuModel,
    rate_hz: float,
    rng: np.random.Generator,
) -> ImuStream:
    times = np.arange(len(rotation)) / RATE
    path = Slerp(times, rotation)
    stamps = np.arange(0.02, times[-1] - 1.0 / rate_hz, 1.0 / rate_hz)
    stamps = stamps + rng.uniform(0.0, 1.0 / rate_hz)
    shape = (len(stamps), 3)
    axis = rng.standard_normal(3)
    angle = rng.uniform(0.2, 1.0) * model.crooked
    alignment = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    middle = np.clip(stamps, DIFFERENCE_S, times[-1] - DIFFERENCE_S)
    turn = path(middle - DIFFERENCE_S).inv() * path(middle + DIFFERENCE_S)
    rate = gaussian_filter1d(turn.as_rotvec() / (2.0 * DIFFERENCE_S), 1.0, axis=0)
    speed = np.clip(np.linalg.norm(rate, axis=1, keepdims=True) / 3.0, 0.2, 2.0)
    skin = model.soft_tissue * speed * slow_process(shape, 0.15, rate_hz, rng)
    sensor = path(stamps) * Rotation.from_rotvec(skin) * alignment
    walk = np.cumsum(rng.standard_normal(len(stamps))) / np.sqrt(rate_hz)
    heading = north + model.field * rng.standard_normal() + model.heading_walk * walk
    if not model.has_magnetometer:
        heading += rng.uniform(-np.pi, np.pi) + model.drift * rng.standard_normal() * stamps
    if model.disturbance:
        swing = slow_process((len(stamps), 1), SWING_S, rate_hz, rng)[:, 0]
        heading += model.disturbance * swing
    tilt = np.zeros(shape)
    tilt[:, :2] = model.tilt * slow_process((len(stamps), 2), 5.0, rate_hz, rng)
    world = Rotation.from_euler("z", heading[:, None]) * Rotation.from_rotvec(tilt)
    gyroscope = alignment.inv().apply(rate) + model.gyro_bias * rng.standard_normal((1, 3))
    return ImuStream(
        segment=segment,
        stamps_s=stamps,
        orientation=(world * sensor).as_quat(),
        angular_velocity=gyroscope + 0.01 * rng.standard_normal(shape),
    )
