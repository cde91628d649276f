"""Forward kinematics of the person's arm: elbow and hand relative to the shoulder."""

import numpy as np

from pose_core.api import FloatArray
from pose_core.errors import InputError
from pose_teleop.extras import require

ANGLES = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")


def angle_names(side: str) -> tuple[str, ...]:
    """The four joint angles of an arm, in the order of every (4,) array."""
    return tuple(f"{side}_{angle}" for angle in ANGLES)


class PersonArm:
    """An arm of the tree that the fusion publishes as ``urdf``.

    Attributes:
        upper, fore: Lengths of upper arm and forearm [m].
        bones: Distance of every joint and link of the tree from its parent joint [m]; they
            distinguish persons.

    Args:
        urdf: The document.
        side: ``left`` or ``right``.

    Raises:
        InputError: If the tree has no such arm.
    """

    def __init__(self, urdf: str, side: str) -> None:
        pin = require("pinocchio")
        self._pin = pin
        try:
            self._model = pin.buildModelFromXML(urdf)
        except (ValueError, RuntimeError) as error:
            raise InputError(f"the person's urdf is not a URDF: {error}") from error
        names = angle_names(side)
        missing = [name for name in names if not self._model.existJointName(name)]
        hands = [f.name for f in self._model.frames if f.name.startswith(f"{side}_hand_joint_")]
        if missing or not hands:
            found = ", ".join(missing) or f"{side}_hand_joint"
            raise InputError(f"the person's urdf has no {found}: expected the fusion's")
        self._data = self._model.createData()
        joints = [self._model.getJointId(name) for name in names]
        self._columns = [self._model.joints[joint].idx_q for joint in joints]
        self._shoulder, self._elbow = joints[0], joints[3]
        self._hand = self._model.getFrameId(hands[0], pin.FrameType.BODY)
        elbow, hand = self.pose(np.zeros(4))
        self.upper = float(np.linalg.norm(elbow))
        self.fore = float(np.linalg.norm(hand - elbow))
        placed = [*self._model.jointPlacements, *(each.placement for each in self._model.frames)]
        self.bones = np.array([np.linalg.norm(each.translation) for each in placed])
        if not (self.upper > 0.0 and self.fore > 0.0):
            raise InputError("the person's urdf has an arm without length")

    def pose(self, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions of elbow and hand [m], (3,), at angles [rad], (4,).

        They are relative to the shoulder, in the trunk's axes (x forward, y left, z up).
        """
        data = self._data
        # All other joints are zero, so that the trunk's axes are the root's.
        posture = np.zeros(self._model.nq)
        posture[self._columns] = angles
        self._pin.computeJointJacobians(self._model, data, posture)
        self._pin.updateFramePlacements(self._model, data)
        shoulder = data.oMi[self._shoulder].translation
        elbow, hand = data.oMi[self._elbow].translation, data.oMf[self._hand].translation
        return elbow - shoulder, hand - shoulder

    def hand_deviation(self, angles: FloatArray, deviations: FloatArray) -> float:
        """Standard deviation of the hand's position [m] from those of the angles [rad], (4,).

        Angles that do not move the hand, such as the rotation of a straight arm, have no effect.
        """
        self.pose(angles)
        J = self._pin.getFrameJacobian(
            self._model, self._data, self._hand, self._pin.LOCAL_WORLD_ALIGNED
        )[:3, self._columns]
        variances = (J * deviations) ** 2  # the angles' errors are assumed to be independent
        return float(np.sqrt(variances.sum()))
