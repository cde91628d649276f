"""Track of one person: position, velocity, body size and the sensors' ids."""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.finite_numbers import nan_mean
from pose_core.people.body_size import BodySize
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import SkeletonSample

POSITION_GAIN = 0.6  # [-] weight of a new frame in the joints' places, one frame after the last
FRAME_S = 1.0 / 30.0  # [s] after n of them, the former places weigh (1 - gain)^n
VELOCITY_WINDOW_NS = 150_000_000  # [ns] over which the velocity is taken
LOST_AFTER_S = 0.1  # [s] unseen by all sensors
MAX_SPEED = 3.5  # [m/s] of a person
VELOCITY_DECAY_S = 0.5  # [s] for which somebody who is not seen keeps their velocity


class Presence(Enum):
    """State of a track."""

    TENTATIVE = "tentative"  # seen for a moment: a person, or a tracker's ghost
    PRESENT = "present"
    ABSENT = "absent"  # known, but not seen


@dataclass
class SensorView:
    """What one sensor calls a person."""

    person: str  # the sensor's own id
    stamp_ns: int  # [ns] of its last frame
    assigned_ns: int  # [ns] of the last one that was assigned by its joints


@dataclass
class PersonTrack:
    """A person: where they are, how large, what the sensors call them."""

    number: int
    presence: Presence
    initiated_ns: int  # [ns] of the first skeleton
    last_seen_ns: int  # [ns]
    initiated_at: FloatArray  # (3,) [m], middle of the first skeleton
    positions: FloatArray  # (15, 3) [m], NaN where never seen
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))  # [m/s]
    size: BodySize = field(default_factory=BodySize)
    recent_size: BodySize | None = None  # to compare with ``size`` before it is merged into it
    recent_since_ns: int = 0  # [ns] when its measurement began
    views: dict[str, SensorView] = field(default_factory=dict)  # by sensor
    held: list[SkeletonSample] = field(default_factory=list)  # of a tentative person
    frames: int = 0
    _updated_ns: int = 0
    _anchor: tuple[int, FloatArray] | None = None  # where the velocity is measured from

    def predicted(self, stamp_ns: int) -> FloatArray:
        """Predicted joints at an instant [ns], shape (15, 3) [m]."""
        ahead_s = self.age_s(stamp_ns)
        way_s = VELOCITY_DECAY_S * (1.0 - np.exp(-ahead_s / VELOCITY_DECAY_S))
        return self.positions + self.velocity * way_s

    def age_s(self, stamp_ns: int) -> float:
        """Time since the last update with joints [s]."""
        return max(0, stamp_ns - self._updated_ns) / NS_PER_S

    @property
    def in_view_s(self) -> float:
        """Time from the first frame to the last one [s]."""
        return (self.last_seen_ns - self.initiated_ns) / NS_PER_S

    def predicted_centre(self, stamp_ns: int) -> FloatArray:
        """Predicted middle at an instant [ns], (3,) [m]."""
        return nan_mean(self.predicted(stamp_ns))

    def unseen_s(self, stamp_ns: int) -> float:
        """Time since any sensor saw them [s]."""
        return max(0, stamp_ns - self.last_seen_ns) / NS_PER_S

    def is_observed(self, stamp_ns: int) -> bool:
        """Whether they are a known person whom a sensor sees at this instant [ns]."""
        return self.presence is Presence.PRESENT and self.unseen_s(stamp_ns) < LOST_AFTER_S

    def is_called(self, person: str, sensor: str) -> bool:
        """Whether a sensor gives them this id."""
        return sensor in self.views and self.views[sensor].person == person

    def update(self, stamp_ns: int, seen: FloatArray, restarts: bool = False) -> None:
        """Update with joints in the common frame, (15, 3) [m]; ``restarts``: not predicted."""
        expected = seen if restarts else self.predicted(stamp_ns)
        frames = max(1.0, self.age_s(stamp_ns) / FRAME_S) if self._updated_ns else 1.0
        gain = 1.0 - (1.0 - POSITION_GAIN) ** frames
        blended = expected + gain * (seen - expected)
        place = np.where(np.isfinite(blended), blended, np.where(np.isfinite(seen), seen, expected))
        if restarts:
            self._anchor, self.velocity = None, np.zeros(3)
        self._measure_velocity(stamp_ns, place)
        self.positions = np.asarray(place)
        self._updated_ns = max(self._updated_ns, stamp_ns)

    def note_detection(self, sample: SkeletonSample, stamp_ns: int) -> None:
        """Note that a sensor has seen them under its id."""
        self.last_seen_ns = max(self.last_seen_ns, stamp_ns)
        self.frames += 1
        self.views[sample.sensor] = SensorView(sample.person, stamp_ns, assigned_ns=stamp_ns)

    def restart_recent_size(self, stamp_ns: int) -> BodySize:
        """Measure the size afresh from an instant [ns] on."""
        self.recent_size, self.recent_since_ns = BodySize(), stamp_ns
        return self.recent_size

    def swap_identity(self, other: "PersonTrack") -> None:
        """Swap number and size with another track; the positions stay."""
        self.number, other.number = other.number, self.number
        self.size, other.size = other.size, self.size
        self.recent_size = other.recent_size = None

    def _measure_velocity(self, stamp_ns: int, positions: FloatArray) -> None:
        if self._anchor is None:
            self._anchor = stamp_ns, nan_mean(positions)
            return
        since_ns = stamp_ns - self._anchor[0]
        if since_ns < VELOCITY_WINDOW_NS:
            return
        here = nan_mean(positions)
        velocity = (here - self._anchor[1]) * (NS_PER_S / since_ns)
        if np.isfinite(velocity).all():
            speed = float(np.linalg.norm(velocity))
            velocity *= min(1.0, MAX_SPEED / max(speed, 1e-9))
            self.velocity = 0.5 * (self.velocity + velocity)
        self._anchor = stamp_ns, here
