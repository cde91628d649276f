"""Monitoring of the person's data: age, continuity, uncertainty."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.api import FloatArray
from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S
from pose_teleop.parameters import ArmParameters
from pose_teleop.person_arm import PersonArm, angle_names
from pose_teleop.supervisor import ArmFault

AHEAD_NS = 20_000_000  # [ns] by which a stamp may be ahead of the clock
SAME_PERSON = 0.02  # [m] largest difference of one person's bone lengths between measurements
UNCERTAIN_NS = 100_000_000  # [ns] accepted duration of an uncertain hand, as in quick motion
TROUBLE_NS = 200_000_000  # [ns] duration of the fault after a jump or a decreasing stamp


@dataclass(frozen=True, kw_only=True)
class Now:
    """The clocks at one instant."""

    steady_ns: int  # [ns] monotonic clock
    ros_ns: int  # [ns] clock of the stamps, which may jump


class InputMonitor:
    """Checks the person's messages for faults.

    Attributes:
        angles, rates: The arm's angles [rad] and rates [rad/s], (4,), of the last valid message.
        stamp_ns: Stamp of the last joint states [ns].
        arm: The person's arm, once its URDF has arrived.

    Args:
        parameters: The arm's side; largest age, jump and standard deviation.
    """

    def __init__(self, parameters: ArmParameters) -> None:
        self._parameters = parameters
        self._names = angle_names(parameters.side)
        self._max_age_ns = round(parameters.max_age * NS_PER_S)
        self.counters = Counters("joint_states", "estimates", *(f.name.lower() for f in ArmFault))
        self._counted: ArmFault | None = None
        self.arm: PersonArm | None = None
        self.angles: FloatArray = np.zeros(4)
        self.rates: FloatArray = np.zeros(4)
        self.stamp_ns = 0
        self.deviation_m = np.nan
        self._person: str | None = None
        self._certain_ns = -UNCERTAIN_NS  # monotonic time of the last certain position of the hand
        self._angles_at: Now | None = None
        self._estimate_at: tuple[Now, int] | None = None
        self._content: dict[str, ArmFault | None] = {"angles": None, "estimate": None}
        self._troubles: dict[ArmFault, int] = {}  # end of each fault, monotonic time

    def add_urdf(self, text: str, now: Now) -> None:
        """Set the person's kinematic tree."""
        before, self.arm = self.arm, PersonArm(text, self._parameters.side)
        if before is None:
            return
        old, new = before.bones, self.arm.bones
        if old.shape != new.shape or np.abs(new - old).max() > SAME_PERSON:
            self._trouble(ArmFault.PERSON_CHANGED, now)

    def add_joint_states(
        self, stamp_ns: int, position: Mapping[str, float], velocity: Mapping[str, float], now: Now
    ) -> None:
        """Add joint states of the person.

        Args:
            stamp_ns: Capture, on the host's clock [ns].
            position: [rad] by name.
            velocity: [rad/s]; missing ones are zero.
            now: When they arrived.
        """
        self.counters.add("joint_states")
        before, before_ns, self.stamp_ns = self._angles_at, self.stamp_ns, stamp_ns
        self._angles_at = now
        if stamp_ns < before_ns:
            self._trouble(ArmFault.CLOCK, now)
        if any(name not in position for name in self._names):
            self._content["angles"] = ArmFault.INCOMPLETE
            return
        angles = self._arm_values(position)
        rates = self._arm_values({**dict.fromkeys(self._names, 0.0), **velocity})
        if not (np.isfinite(angles).all() and np.isfinite(rates).all()):
            self._content["angles"] = ArmFault.NOT_FINITE
            return
        is_fresh = before is not None and not self._is_old(before, now)
        if is_fresh and np.abs(angles - self.angles).max() > self._parameters.max_jump:
            self._trouble(ArmFault.JUMPED, now)
        self._content["angles"] = None
        self.angles, self.rates = angles, rates

    def add_estimate(
        self,
        stamp_ns: int,
        person: str,
        position: Mapping[str, float],
        stddev: Mapping[str, float],
        now: Now,
    ) -> None:
        """Add an estimate of the person.

        Args:
            stamp_ns: Its stamp [ns].
            person: The person's id.
            position: [rad] by name; NaN: unknown.
            stddev: Standard deviations [rad].
            now: When it arrived.
        """
        self.counters.add("estimates")
        self._estimate_at = now, stamp_ns
        if self._person is not None and person != self._person:
            self._trouble(ArmFault.PERSON_CHANGED, now)
        self._person = person
        known, deviations = self._arm_values(position), self._arm_values(stddev)
        if not np.isfinite(deviations).all():
            self._content["estimate"] = ArmFault.NOT_FINITE
            return
        if self.arm is not None:
            # Joint states hold an unknown angle, while its standard deviation grows.
            held = np.where(np.isfinite(known), known, self.angles)
            self.deviation_m = self.arm.hand_deviation(held, deviations)
        if not self.deviation_m > self._parameters.max_deviation:
            self._certain_ns = now.steady_ns
        is_uncertain = now.steady_ns - self._certain_ns > UNCERTAIN_NS
        self._content["estimate"] = ArmFault.UNCERTAIN if is_uncertain else None

    def count(self, fault: ArmFault | None) -> None:
        """Count a fault, of the input or another one, when it begins."""
        if fault is not None and fault is not self._counted:
            self.counters.add(fault.name.lower())
        self._counted = fault

    def fault(self, now: Now) -> ArmFault | None:
        """The current fault of the input, None without one."""
        if self.arm is None:
            return ArmFault.NO_URDF
        if self._angles_at is None or self._estimate_at is None:
            return ArmFault.LOST
        estimate_at, estimate_stamp_ns = self._estimate_at
        for fault, until_ns in self._troubles.items():
            if now.steady_ns < until_ns:
                return fault
        if self._is_old(self._angles_at, now) or self._is_old(estimate_at, now):
            return ArmFault.STALE
        stamps = (self.stamp_ns, estimate_stamp_ns)
        if max(stamps) - now.ros_ns > AHEAD_NS:
            return ArmFault.CLOCK
        if now.ros_ns - min(stamps) > self._max_age_ns:
            return ArmFault.STALE
        return self._content["angles"] or self._content["estimate"]

    def _arm_values(self, values: Mapping[str, float]) -> FloatArray:
        """Those of the arm's four angles; NaN where there is none."""
        return np.array([values.get(name, np.nan) for name in self._names], float)

    def _is_old(self, heard: Now, now: Now) -> bool:
        return now.steady_ns - heard.steady_ns > self._max_age_ns

    def _trouble(self, fault: ArmFault, now: Now) -> None:
        self._troubles[fault] = now.steady_ns + TROUBLE_NS
