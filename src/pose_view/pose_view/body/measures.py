"""Body measures from joint positions."""

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from pose_core.api import FloatArray
from pose_core.joints import JOINT_INDEX, SIDES
from pose_evaluation.stability import bone_lengths

LIMBS = ("upper_arm", "forearm", "thigh", "shank")
TRUNK = ("hips", "shoulders", "lower_trunk", "upper_trunk", "neck")
SAMPLES = 45  # [-] over which the median is computed
FIRST_AT = 10  # [-] samples required for the first result
CHANGED = 0.01  # [m] change from which on the body is drawn again


@dataclass(frozen=True, kw_only=True)
class BodyMeasures:
    """Distances between joints [m]; of pairs, left then right."""

    upper_arm: tuple[float, float]
    forearm: tuple[float, float]
    thigh: tuple[float, float]
    shank: tuple[float, float]
    hips: float  # from hip to hip
    shoulders: float  # from shoulder to shoulder
    lower_trunk: float  # from between the hips to the torso joint
    upper_trunk: float  # from the torso joint to the neck
    neck: float  # from the neck to the head joint

    @property
    def size(self) -> float:
        """The legs' length relative to an adult's of 1.75 m: scale of all thicknesses [-]."""
        return (sum(self.thigh) + sum(self.shank)) / 2.0 / 0.82

    def differs_from(self, other: "BodyMeasures") -> bool:
        """Whether a measure differs by more than :data:`CHANGED`."""
        own, others = (np.hstack(list(vars(each).values())) for each in (self, other))
        return bool(np.abs(own - others).max() > CHANGED)


def measure(joints: FloatArray) -> BodyMeasures:
    """Median body measures of one or several skeletons.

    Args:
        joints: Joint positions [m], shape (n, 15, 3), without NaN.
    """
    at = {name: joints[:, index] for name, index in JOINT_INDEX.items()}
    hips = 0.5 * (at["left_hip"] + at["right_hip"])
    lengths = bone_lengths(joints) | {
        "lower_trunk": np.linalg.norm(hips - at["torso"], axis=1),
        "upper_trunk": np.linalg.norm(at["torso"] - at["neck"], axis=1),
    }
    median = {name: float(np.median(length)) for name, length in lengths.items()}
    found: dict[str, Any] = {name: median[name] for name in TRUNK}
    found |= {limb: tuple(median[f"{side}_{limb}"] for side in SIDES) for limb in LIMBS}
    return BodyMeasures(**found)


class MeasuredBody:
    """Measures bone lengths from a stream of skeletons and reports when they have changed."""

    def __init__(self) -> None:
        self._samples: deque[FloatArray] = deque(maxlen=SAMPLES)
        self._count = 0
        self.measures: BodyMeasures | None = None

    def add(self, joints: FloatArray) -> bool:
        """Add one skeleton, shape (15, 3) [m]; returns whether the measures have changed."""
        if not np.isfinite(joints).all():
            return False
        self._samples.append(joints)
        self._count += 1
        if self._count != FIRST_AT and self._count % SAMPLES:
            return False
        found = measure(np.stack(self._samples))
        if self.measures is not None and not found.differs_from(self.measures):
            return False
        self.measures = found
        return True
