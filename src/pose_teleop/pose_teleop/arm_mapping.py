"""Mapping of a person's arm to a robot's: by joints, or by the hand's position."""

from abc import ABC, abstractmethod

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray
from pose_core.errors import InputError
from pose_teleop.inverse_kinematics import ArmGoal, reach
from pose_teleop.person_arm import ANGLES, PersonArm
from pose_teleop.robot_arm import RobotArm

MODES = ("joints", "wrist")
AHEAD_S = 0.01  # [s] time step for the target's rate
FIRST_ITERATIONS = 200  # from the rest posture
ITERATIONS = 3  # from the previous target


class ArmMapping(ABC):
    """Mapping of a person's four arm angles to a robot's n joints."""

    @abstractmethod
    def target(self, angles: FloatArray) -> FloatArray:
        """The robot's joints [rad], (n,), within limits, for the person's angles [rad], (4,)."""

    def reset(self) -> None:  # noqa: B027 (most have none)
        """Drop the previous target: the next one may be far from it."""

    def target_and_rate(
        self, angles: FloatArray, rates: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The target [rad] and its rate [rad/s], (n,), for angles [rad] and rates [rad/s], (4,)."""
        now = self.target(angles)
        return now, (self.ahead(angles + AHEAD_S * rates) - now) / AHEAD_S

    def ahead(self, angles: FloatArray) -> FloatArray:
        """Compute a target without storing it."""
        return self.target(angles)


class JointMapping(ArmMapping):
    """Each robot joint follows one angle: ``scale * angle + offset``; the others stay at rest.

    Args:
        arm: The robot's arm, whose file has the rules.

    Raises:
        InputError: If it has no rules, or a rule of an unknown joint or angle.
    """

    def __init__(self, arm: RobotArm) -> None:
        self._arm = arm
        rules = arm.file.rules
        if not rules:
            raise InputError(
                f"robot {arm.file.name} has no map from joint to joint: use mode:=wrist"
            )
        unknown = [r.angle for r in rules if r.angle not in ANGLES]
        unknown += [r.joint for r in rules if r.joint not in arm.joints]
        if unknown:
            known = ", ".join(ANGLES)
            raise InputError(f"map of {arm.file.name}: unknown {', '.join(unknown)}; from {known}")
        self._rows = [arm.joints.index(rule.joint) for rule in rules]
        self._columns = [ANGLES.index(rule.angle) for rule in rules]
        self._scale = np.array([rule.scale for rule in rules])
        self._offset = np.array([rule.offset for rule in rules])

    def target(self, angles: FloatArray) -> FloatArray:
        """See :meth:`ArmMapping.target`."""
        q = self._arm.rest.copy()
        q[self._rows] = self._scale * angles[self._columns] + self._offset
        return np.clip(q, self._arm.lower, self._arm.upper)


class WristMapping(ArmMapping):
    """The tool's position relative to the shoulder is the hand's, scaled by the arms' lengths.

    The elbow and the forearm's direction are used as secondary goals.

    Args:
        arm: The robot's arm.
        person: The person's arm.
        mirror: Whether to exchange left and right.
        scale: Scale of the tool's distance, times the ratio of the arms' lengths [-].
    """

    def __init__(self, arm: RobotArm, person: PersonArm, mirror: bool, scale: float) -> None:
        self._arm, self._person = arm, person
        # Roll, pitch, yaw about fixed axes, as in URDF.
        R_trunk_root = Rotation.from_euler("xyz", arm.file.mount).as_matrix()
        self._R_root_trunk = R_trunk_root.T @ np.diag([1.0, -1.0 if mirror else 1.0, 1.0])
        self._scale = scale
        self._before: FloatArray | None = None

    def reset(self) -> None:
        """See :meth:`ArmMapping.reset`."""
        self._before = None

    def target(self, angles: FloatArray) -> FloatArray:
        """See :meth:`ArmMapping.target`."""
        start, count = self._before, ITERATIONS
        if start is None:
            start, count = self._arm.rest, FIRST_ITERATIONS
        self._before = reach(self._arm, self.goal(angles), start, count)
        return self._before

    def ahead(self, angles: FloatArray) -> FloatArray:
        """See :meth:`ArmMapping.ahead`."""
        assert self._before is not None
        return reach(self._arm, self.goal(angles), self._before, 1)

    def goal(self, angles: FloatArray) -> ArmGoal:
        """The goal of the inverse kinematics for the person's angles [rad], (4,)."""
        (elbow, hand), (upper, fore) = self._person.pose(angles), self._arm.segments
        shoulder, _ = self._arm.place(self._arm.file.shoulder)
        turned = self._R_root_trunk @ np.stack([elbow, hand, hand - elbow]).T
        ratio = self._scale * (upper + fore) / (self._person.upper + self._person.fore)
        return ArmGoal(
            elbow=shoulder + turned[:, 0] / self._person.upper * upper,
            tool=shoulder + turned[:, 1] * ratio,
            direction=turned[:, 2] / np.linalg.norm(turned[:, 2]),
        )
