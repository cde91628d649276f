"""Errors of the virtual IMU nodes: parameters and presets."""

from dataclasses import dataclass, replace

from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class ImuParameters:
    """Parameters of the virtual IMU nodes; errors are standard deviations by default."""

    sample_rate: float = parameter(
        100.0, unit="Hz", limits=(10.0, 1000.0), doc="sample rate of each node"
    )
    clock_drift: float = parameter(
        25.0, unit="ppm", limits=(0.0, 1000.0), doc="drift of each node's clock"
    )
    radio_latency: float = parameter(
        0.003,
        unit="s",
        limits=(0.0, 0.5),
        doc="minimum latency from sampling to arrival at the host",
    )
    radio_jitter: float = parameter(
        0.001, unit="s", limits=(0.0, 0.2), doc="mean of the additional latency"
    )
    gyroscope_noise: float = parameter(
        0.06, unit="deg/s", limits=(0.0, 50.0), doc="white noise of a gyroscope sample"
    )
    gyroscope_bias: float = parameter(
        0.8, unit="deg/s", limits=(0.0, 50.0), doc="constant bias of each gyroscope axis"
    )
    gyroscope_bias_walk: float = parameter(
        0.01, unit="deg/s/sqrt(s)", limits=(0.0, 1.0), doc="random walk of that bias"
    )
    accelerometer_noise: float = parameter(
        0.04, unit="m/s^2", limits=(0.0, 10.0), doc="white noise of an accelerometer sample"
    )
    accelerometer_bias: float = parameter(
        0.06, unit="m/s^2", limits=(0.0, 10.0), doc="constant bias of each accelerometer axis"
    )
    magnetometer_noise: float = parameter(
        0.5, unit="uT", limits=(0.0, 50.0), doc="white noise of a magnetometer sample"
    )
    field_strength: float = parameter(
        48.0, unit="uT", limits=(10.0, 100.0), doc="strength of the earth's field"
    )
    field_dip: float = parameter(
        62.0, unit="deg", limits=(-90.0, 90.0), doc="inclination of the field below the horizon"
    )
    disturbance: float = parameter(
        3.0, unit="uT", limits=(0.0, 100.0), doc="constant disturbance at each node, per axis"
    )
    disturbance_change: float = parameter(
        1.0, unit="uT", limits=(0.0, 100.0), doc="slowly varying disturbance, per axis"
    )
    misalignment_min: float = parameter(
        5.0,
        unit="deg",
        limits=(0.0, 180.0),
        doc="minimum misalignment of the nodes with their segments",
    )
    misalignment_max: float = parameter(
        20.0,
        unit="deg",
        limits=(0.0, 180.0),
        doc="maximum misalignment of the nodes with their segments",
    )


TYPICAL = ImuParameters()
_ALIKE = (
    *("sample_rate", "clock_drift", "radio_latency"),
    *("radio_jitter", "field_strength", "field_dip"),
)
"""Parameters that are the same in all presets; the others are errors."""


def _scaled(factor: float) -> ImuParameters:
    errors = {name: factor * value for name, value in vars(TYPICAL).items() if name not in _ALIKE}
    return replace(TYPICAL, **errors)


CLEAN = replace(_scaled(0.0), clock_drift=0.0, radio_jitter=0.0)
EASY = _scaled(0.5)
HARD = replace(_scaled(2.5), radio_jitter=0.003, misalignment_min=5.0, misalignment_max=35.0)
PRESETS = {"clean": CLEAN, "easy": EASY, "typical": TYPICAL, "hard": HARD}
"""``clean``: no errors; ``easy``: half of ``typical``'s; ``typical``: an MPU-9150 indoors;
``hard``: near iron, badly strapped."""
