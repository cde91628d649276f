"""Parameters of the live calibration."""

from dataclasses import dataclass

from pose_calibration.extrinsics.parameters import ROTATION_DOC, CalibrationParameters
from pose_core.api import LITTLE_MOTION, MAX_GAP_S
from pose_core.parameters import parameter, run_parameter, sensors_parameter


@dataclass(frozen=True, kw_only=True)
class LiveCalibrationParameters(CalibrationParameters):
    """Parameters of the calibration node."""

    sensors: tuple[str, ...] = sensors_parameter("names of the Kinects, the reference first")
    file: str = parameter(
        "",
        doc="YAML of the calibration: read if it exists, otherwise written when the "
        "calibration is known",
    )
    keep_given: bool = parameter(
        True,
        doc="keep the sensors' poses that another node publishes on /tf_static before any are found"
        " here, and estimate clocks alone",
    )
    run: str = run_parameter()
    rotation_stddev: float = parameter(  # a recording cannot be continued, a person can
        LITTLE_MOTION, unit="rad", limits=(0.001, 0.2), doc=ROTATION_DOC
    )
    minimum_duration: float = parameter(
        3.0, unit="s", limits=(0.5, 600.0), doc="time of common view before the first solution"
    )
    collect_duration: float = parameter(
        60.0,
        unit="s",
        limits=(1.0, 3600.0),
        doc="time of common view after which the calibration ends in any case",
    )
    enough_rotation_stddev: float = parameter(
        0.008,
        unit="rad",
        limits=(0.005, 0.1),
        doc="uncertainty of every rotation below which the calibration ends",
    )
    enough_position_stddev: float = parameter(
        0.015,
        unit="m",
        limits=(0.001, 0.2),
        doc="uncertainty of every sensor's position below which the calibration ends",
    )
    watch: bool = parameter(True, doc="compare the views afterwards and report a moved sensor")
    recalibrate_when_moved: bool = parameter(
        False, doc="calibrate again automatically when a sensor has been moved"
    )
    max_offset: float = parameter(
        0.5, unit="s", limits=(0.0, 5.0), doc="largest offset between two sensors' clocks"
    )
    max_skew: float = parameter(
        0.02, unit="s", limits=(0.001, 0.1), doc="largest difference of stamps in a pair of frames"
    )
    max_gap: float = parameter(
        MAX_GAP_S,
        unit="s",
        limits=(0.02, 1.0),
        doc="longest gap of one sensor to interpolate across",
    )
    max_wait: float = parameter(
        0.2, unit="s", limits=(0.05, 2.0), doc="longest silence of a sensor to wait for"
    )
