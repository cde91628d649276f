"""Errors of the virtual IMU nodes: parameters and presets."""

from dataclasses import dataclass, replace

from pose_core.parameters import parameter
from pose_sim.sizes import scaled, size


@dataclass(frozen=True, kw_only=True)
class ImuParameters:
    """Parameters of the virtual IMU nodes; errors are standard deviations by default."""

    sample_rate: float = parameter(
        100.0, unit="Hz", limits=(10.0, 1000.0), doc="sample rate of each node"
    )
    clock_drift: float = size(25.0, "ppm", 1000.0, "drift of each node's clock")
    radio_latency: float = size(
        0.003, "s", 0.5, "minimum latency from sampling to arrival at the host"
    )
    radio_jitter: float = size(0.001, "s", 0.2, "mean of the additional latency")
    gyroscope_noise: float = size(0.06, "deg/s", 50.0, "white noise of a gyroscope sample")
    gyroscope_bias: float = size(0.8, "deg/s", 50.0, "constant bias of each gyroscope axis")
    gyroscope_bias_walk: float = size(0.01, "deg/s/sqrt(s)", 1.0, "random walk of that bias")
    accelerometer_noise: float = size(0.04, "m/s^2", 10.0, "white noise of an accelerometer sample")
    accelerometer_bias: float = size(
        0.06, "m/s^2", 10.0, "constant bias of each accelerometer axis"
    )
    magnetometer_noise: float = size(0.5, "uT", 50.0, "white noise of a magnetometer sample")
    field_strength: float = parameter(
        48.0, unit="uT", limits=(10.0, 100.0), doc="strength of the earth's field"
    )
    field_dip: float = parameter(
        62.0, unit="deg", limits=(-90.0, 90.0), doc="inclination of the field below the horizon"
    )
    disturbance: float = size(3.0, "uT", 100.0, "constant disturbance at each node, per axis")
    disturbance_change: float = size(1.0, "uT", 100.0, "slowly varying disturbance, per axis")
    misalignment_min: float = size(
        5.0, "deg", 180.0, "minimum misalignment of the nodes with their segments"
    )
    misalignment_max: float = size(
        20.0, "deg", 180.0, "maximum misalignment of the nodes with their segments"
    )


TYPICAL = ImuParameters()
_ALIKE = (
    *("sample_rate", "clock_drift", "radio_latency"),
    *("radio_jitter", "field_strength", "field_dip"),
)
"""Parameters that are the same in all presets; the others are errors."""


CLEAN = replace(scaled(TYPICAL, 0.0, _ALIKE), clock_drift=0.0, radio_jitter=0.0)
EASY = scaled(TYPICAL, 0.5, _ALIKE)
HARD = replace(
    scaled(TYPICAL, 2.5, _ALIKE), radio_jitter=0.003, misalignment_min=5.0, misalignment_max=35.0
)
PRESETS = {"clean": CLEAN, "easy": EASY, "typical": TYPICAL, "hard": HARD}
"""``clean``: no errors; ``easy``: half of ``typical``'s; ``typical``: an MPU-9150 indoors;
``hard``: near iron, badly strapped."""
