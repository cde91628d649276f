"""Kinematics of a robot's arm: the controlled joints of a URDF; its other joints are fixed."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray
from pose_core.errors import InputError
from pose_teleop.extras import require
from pose_teleop.robot_files import RobotFile

MAX_TURN = 6.3  # [rad] larger limits count as none


class RobotArm:
    """Kinematics and limits of an arm with n joints.

    Attributes:
        joints: Their names, in the order of every (n,) array.
        lower, upper: Limits of position [rad], (n,).
        max_velocity: [rad/s] (n,): the URDF's, and no more than the robot file's.
        max_effort: [N m] (n,).
        rest: [rad] (n,).

    Raises:
        InputError: If the URDF cannot be read or lacks what the robot file names.
    """

    def __init__(self, robot: RobotFile) -> None:
        pin = require("pinocchio")
        self._pin = pin
        self.file = robot
        self.joints = robot.joints
        try:
            whole = pin.buildModelFromUrdf(str(robot.urdf))
        except (ValueError, RuntimeError) as error:
            raise InputError(f"{robot.urdf} is not a URDF: {error}") from error
        self._check_names(whole)
        still = [i for i in range(1, whole.njoints) if whole.names[i] not in robot.joints]
        self.whole = whole
        self.model = pin.buildReducedModel(whole, still, self._posture(whole, robot.rest))
        self.data = self.model.createData()
        chain = [self.model.getJointId(name) for name in robot.joints]
        columns = [self.model.joints[i].idx_v for i in chain]
        if sorted(columns) != list(range(self.model.nq)):
            raise InputError(f"{robot.name}: a joint of the arm is not revolute with one angle")
        self._order = np.array(columns)
        self.lower = np.clip(self.model.lowerPositionLimit[columns], -MAX_TURN, MAX_TURN)
        self.upper = np.clip(self.model.upperPositionLimit[columns], -MAX_TURN, MAX_TURN)
        top = robot.max_velocity or np.inf
        self.max_velocity = np.minimum(self.model.velocityLimit[columns], top)
        self.max_effort = self.model.effortLimit[columns]
        self.rest = np.clip(np.array(robot.rest), self.lower, self.upper)
        self._frames = {
            name: self.model.getFrameId(name, pin.FrameType.BODY) for name in self._frame_names()
        }
        self.segments = self._segment_lengths()

    def model_order(self, q: FloatArray) -> FloatArray:
        """Reorder values of the joints (n,) to pinocchio's order."""
        ordered = np.empty(len(self._order))
        ordered[self._order] = q
        return ordered

    def our_order(self, values: FloatArray) -> FloatArray:
        """Reorder values in pinocchio's order to the joints' order, (n,)."""
        return np.asarray(values)[..., self._order]

    def update(self, q: FloatArray) -> None:
        """Compute all frames and Jacobians at joint angles [rad], (n,)."""
        self._pin.computeJointJacobians(self.model, self.data, self.model_order(q))
        self._pin.updateFramePlacements(self.model, self.data)

    def place(self, frame: str) -> tuple[FloatArray, FloatArray]:
        """Position [m] and rotation matrix of a frame in the robot's root, as last updated."""
        found = self.data.oMf[self._frames[frame]]
        return found.translation, found.rotation

    def jacobian(self, frame: str) -> FloatArray:
        """(6, n): linear then angular velocity of a frame in the root's axes, as last updated."""
        found = self._pin.getFrameJacobian(
            self.model, self.data, self._frames[frame], self._pin.LOCAL_WORLD_ALIGNED
        )
        return self.our_order(found)

    def _frame_names(self) -> tuple[str, str, str]:
        return self.file.shoulder, self.file.elbow, self.file.tool

    def _check_names(self, whole: Any) -> None:
        for name in self.file.joints:
            if not whole.existJointName(name):
                raise InputError(f"{self.file.urdf} has no joint '{name}'")
        for name in self._frame_names():
            if not whole.existFrame(name):
                raise InputError(f"{self.file.urdf} has no link '{name}'")

    def _posture(self, whole: Any, q: Sequence[float] | FloatArray) -> FloatArray:
        """All joints of the robot, the arm at angles [rad], (n,)."""
        posture = self._pin.neutral(whole)
        for name, angle in zip(self.joints, q, strict=True):
            posture[whole.joints[whole.getJointId(name)].idx_q] = angle
        return posture

    def _segment_lengths(self) -> tuple[float, float]:
        """Shoulder to elbow and elbow to tool [m]."""
        self.update(self.rest)
        shoulder, elbow, tool = (self.place(name)[0].copy() for name in self._frame_names())
        return float(np.linalg.norm(elbow - shoulder)), float(np.linalg.norm(tool - elbow))

    def mount_quaternion(self, yaw: float) -> FloatArray:
        """Orientation of the robot's root in map at a heading [rad]: quaternion x, y, z, w."""
        turned = Rotation.from_euler("z", yaw) * Rotation.from_euler("xyz", self.file.mount)
        return np.asarray(turned.as_quat())

    def links(self, q: FloatArray) -> dict[str, FloatArray]:
        """Position [m] and quaternion (x, y, z, w), (7,), of links in the root, at angles (n,)."""
        whole, pin = self.whole, self._pin
        data = whole.createData()
        pin.framesForwardKinematics(whole, data, self._posture(whole, q))
        return {
            frame.name: pin.SE3ToXYZQUAT(data.oMf[i])
            for i, frame in enumerate(whole.frames)
            if frame.type == pin.FrameType.BODY
        }
