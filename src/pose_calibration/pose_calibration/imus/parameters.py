"""Parameters of the IMUs' calibration."""

from dataclasses import dataclass

from pose_core.parameters import NAME_ENDING, parameter, sensors_parameter


@dataclass(frozen=True, kw_only=True)
class ImuCalibrationParameters:
    """Parameters of ``./pose calibrate imu``, live and offline."""

    sensors: tuple[str, ...] = sensors_parameter("names of the Kinects, the reference first")
    person: str = parameter(
        "first",
        doc="the wearer of the IMUs: `first`, `nearest` (to the first sensor), or a sensor's id",
    )
    worn: tuple[str, ...] = parameter(
        (), doc="segments that must carry an IMU; empty: those with samples", pattern=NAME_ENDING
    )
    tracker_delay: float = parameter(
        0.0, unit="s", limits=(0.0, 0.2), doc="known delay of the Kinects' joints"
    )
    minimum_duration: float = parameter(
        15.0, unit="s", limits=(2.0, 600.0), doc="shortest time of motion in view of the cameras"
    )
    collect_duration: float = parameter(
        60.0,
        unit="s",
        limits=(5.0, 600.0),
        doc="duration of motion after which it ends in any case",
    )
    enough_stddev: float = parameter(
        0.07,
        unit="rad",
        limits=(0.04, 0.5),
        doc="stated uncertainty of an alignment's tilt and turn below which it is accepted",
    )
