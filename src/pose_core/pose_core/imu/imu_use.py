"""State of use of an IMU: since when it is used, its alignment, or why it is not used."""

from dataclasses import dataclass, field

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.stamps import NS_PER_S

NOISY = 5.0  # [-] factor of its noise from which an IMU is named
MOST_SHOWN = 8  # [-] alignments
MOVED = np.cos(np.radians(8.0))  # [-] cosine of the angle from which on a sensor has moved
DRIFTING = np.radians(1.0)  # [rad/s] the same of its heading's drift


@dataclass(kw_only=True)
class ImuUse:
    """State of use of one IMU."""

    segment: str
    has_moved: bool = False  # whether it has turned by 8° since it was first heard, or slipped
    is_aligned: bool = False
    start_ns: int = 0  # [ns] stamp of the first sample of any source
    alignments_ns: list[int] = field(default_factory=list)  # [ns] stamps from which on it was used
    frames: int = 0  # also those without a sample of it
    frames_used: int = 0
    contradictions: int = 0  # times that it had slipped or did not fit, and was aligned again
    tilt_stddev: float = float("nan")  # [rad] of its alignment, about axes across the link
    turn_stddev: float = float("nan")  # [rad] of its alignment, about the link's own axis
    heading_stddev: float = float("nan")  # [rad]
    noise: float = 1.0  # [-] factor of its usual noise, see pose_core.filter.imu_noise
    heading_drift: float = 0.0  # [rad/s] see pose_core.filter.heading_drift
    has_link: bool = True  # whether the body model has a link for the segment
    does_not_fit: bool = False  # whether its motion does not fit its segment
    exchanged_with: str = ""  # the segment on which it is worn and used, if not its own
    refused: str = ""  # why the estimator cannot use it at all, and what to do
    remark: str = ""  # what is wrong with its samples, what is used instead, and its silences

    def note_orientation(self, R_world_first: FloatArray, R_world_sensor: FloatArray) -> None:
        """Find out whether it moves: one that lies on a table fits a segment at rest.

        Args:
            R_world_first: Its orientation when it was first heard, (3, 3).
            R_world_sensor: Its orientation now, (3, 3).
        """
        trace = np.einsum("ij,ij", R_world_sensor, R_world_first)
        self.has_moved |= bool(trace < 1.0 + 2.0 * MOVED)

    def note_aligned(self, stamp_ns: int) -> None:
        """Note that it is used from an instant [ns] on."""
        self.is_aligned = True
        self.alignments_ns.append(stamp_ns)

    @property
    def aligned_ns(self) -> int | None:
        """Stamp of its last alignment [ns]."""
        return self.alignments_ns[-1] if self.alignments_ns else None

    def note_variance(self, variance: FloatArray) -> None:
        """Note the variances of its alignment and heading, (4,) [rad²]."""
        x, y, z, heading = np.sqrt(variance).tolist()
        self.tilt_stddev, self.turn_stddev, self.heading_stddev = max(x, y), z, heading

    @property
    def reason(self) -> str:
        """Why it is not used, and what to do; empty if it is."""
        if self.refused:
            return self.refused
        if not self.has_link:
            return "the body model has no link for this segment: wear it on, or name, another one"
        if self.is_aligned:
            return ""
        if not (self.has_moved or self.contradictions):
            return (
                "it has not turned by 8° yet: move its segment; if that has moved, strap the IMU "
                "on, or check whether it is stuck"
            )
        if self.does_not_fit:
            return (
                "its motion does not fit this segment as the cameras see it: is it worn there, "
                "and is its clock right?"
            )
        if self.contradictions:
            what = "the cameras or its gyroscope contradict it"
            return f"{what}: check its strap and its segment; move to realign it"
        return "not aligned yet: move, lean and turn the segment in view of the cameras"

    def __str__(self) -> str:
        return f"{self._use}; {self.remark}" if self.remark else self._use

    @property
    def _use(self) -> str:
        share = f"for {100.0 * self.frames_used / max(self.frames, 1):.0f} % of frames"
        if self.reason:
            before = f"; before, it was used {share}" if self.frames_used else ""
            return f"{self.segment}: not used, {self.reason}{before}"
        tilt, turn, heading = np.degrees([self.tilt_stddev, self.turn_stddev, self.heading_stddev])
        times = "once" if self.contradictions == 1 else f"{self.contradictions} times"
        anew = f"; aligned anew {times}: see its strap, and magnets"
        times_noise = f"{self.noise:.1f} times the usual noise"
        noisy = f"; {times_noise}, so it counts less: see its strap, its clock and its filter"
        drift = f"its heading drifts by {np.degrees(abs(self.heading_drift)):.1f}°/s"
        drifting = f"; {drift}, which is corrected: have its gyroscope's bias estimated at rest"
        since, *again = (
            f"{(ns - self.start_ns) / NS_PER_S:.1f}" for ns in self.alignments_ns or [self.start_ns]
        )
        times_again = f" (aligned again at {', '.join(again[-MOST_SHOWN:])} s)" if again else ""
        return (
            f"{self.segment}: used from {since} s on{times_again}, {share}, "
            f"tilt known to {tilt:.1f}°, turn to {turn:.1f}°, heading to {heading:.1f}°"
            + (anew if self.contradictions else "")
            + (noisy if self.noise > NOISY else "")
            + (drifting if abs(self.heading_drift) > DRIFTING else "")
        )
