"""Parameters of the extrinsics' estimation, live and offline."""

from dataclasses import dataclass

from pose_calibration.floor.floor import KnownMounting
from pose_core.parameters import parameter

ESTIMATED, KNOWN_TILT, KNOWN_HEIGHT, KNOWN = "estimated", "known_tilt", "known_height", "known"
ROTATION_DOC = "uncertainty of a sensor's rotation above which the calibration is refused"


@dataclass(frozen=True, kw_only=True)
class CalibrationParameters:
    """Parameters of the calibration, live and offline."""

    person: str = parameter(
        "",
        doc="a sensor's id of the person, not a rule such as `first`; empty: one whose views agree",
    )
    minimum_frames: int = parameter(
        60,
        limits=(10, 100_000),
        doc="required frames in which a sensor and the first one see the person",
    )
    rotation_stddev: float = parameter(0.0873, unit="rad", limits=(0.001, 0.2), doc=ROTATION_DOC)
    median_residual: float = parameter(
        0.25,
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
