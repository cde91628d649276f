"""Parameters of the calibration."""

from dataclasses import dataclass

from pose_calibration.floor.floor import KnownMounting
from pose_core.api import MAX_GAP_S
from pose_core.parameters import NAME_ENDING, RUN, parameter

ESTIMATED, KNOWN_TILT, KNOWN_HEIGHT, KNOWN = "estimated", "known_tilt", "known_height", "known"


@dataclass(frozen=True, kw_only=True)
class CalibrationParameters:
    """Parameters of the calibration, live and offline."""

    person: str = parameter(
        "", doc="a sensor's id of the person; empty: a person whose views agree"
    )
    minimum_frames: int = parameter(
        60,
        limits=(10, 100_000),
        doc="required frames in which a sensor and the first one see the person",
    )
    rotation_stddev: float = parameter(
        0.0262,
        unit="rad",
        limits=(0.001, 0.2),
        doc="uncertainty of a sensor's rotation above which the calibration is refused",
    )
    median_residual: float = parameter(
        0.15,
        unit="m",
        limits=(0.01, 1.0),
        doc="median distance of a joint between two views above which the calibration is refused",
    )
    mounting: str = parameter(
        ESTIMATED,
        choices=(ESTIMATED, KNOWN_TILT, KNOWN_HEIGHT, KNOWN),
        doc="whether tilt and height of the first sensor are estimated or given below",
    )
    sensor_tilt: float = parameter(
        0.0, unit="rad", limits=(-1.2, 1.2), doc="downward tilt of the first sensor, if given"
    )
    sensor_height: float = parameter(
        1.0,
        unit="m",
        limits=(0.0, 10.0),
        doc="height of the first sensor above the floor, if given",
    )

    @property
    def known_mounting(self) -> KnownMounting:
        """Known tilt and height of the first sensor."""
        return KnownMounting(
            tilt=self.sensor_tilt if self.mounting in (KNOWN, KNOWN_TILT) else None,
            height=self.sensor_height if self.mounting in (KNOWN, KNOWN_HEIGHT) else None,
        )


@dataclass(frozen=True, kw_only=True)
class LiveCalibrationParameters(CalibrationParameters):
    """Parameters of the calibration node."""

    sensors: tuple[str, ...] = parameter(
        ("left", "right"),
        doc="names of the Kinects, the reference first",
        pattern=NAME_ENDING,
    )
    file: str = parameter(
        "",
        doc="YAML of the calibration: read if it exists, otherwise written when the "
        "calibration is known",
    )
    run: str = parameter(
        "",
        doc="name of the graph's run: a node that is restarted within a run continues with "
        "its previous results; empty: no results are kept",
        pattern=RUN,
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
        0.007,
        unit="rad",
        limits=(0.0005, 0.1),
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
        0.5, unit="s", limits=(0.0, 2.0), doc="largest offset between two sensors' clocks"
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
