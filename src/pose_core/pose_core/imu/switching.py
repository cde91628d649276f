r"""Between Kinect and IMU, quickly and without a step.

zhang2015 switches to the IMU where the Kinect's state says that a joint is not tracked. Trackers
call many a hidden joint tracked, so what the IMU says is asked as well: the Kinect is not believed
while both differ by more than a multiple of what they have differed by lately, at least of what
their variances let expect. Whatever the weights do, what goes out keeps to the IMU, whose motion
has no steps, and its correction by the Kinect changes by a little in each update only.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.body.kinematics import rotation_from_vector
from pose_core.streams.samples import FloatArray

OCCLUDED = 3.0  # [-] standard deviations between both, from which on the Kinect is not believed
VISIBLE = 2.0  # [-] and below which it is again
MEMORY = 60  # [-] updates that the present noise comes from
SLOW_MEMORY = 300  # [-] the same while it is not believed: in the end both may differ for good
LARGEST_STEP = math.radians(1.4)  # [rad] of one link in one update; a joint has two links


class OcclusionDetector:
    """Tells for one link whether the Kinect sees it."""

    def __init__(self) -> None:
        self.is_occluded = False
        self._noise: float | None = None  # [rad²] of the distance, lately

    def update(self, distance: float, variance: float) -> bool:
        """Whether the link must be taken for hidden, whatever its tracking state.

        Args:
            distance: Angle [rad] between Kinect and IMU.
            variance: What the variances of both let expect of its square [rad²].
        """
        noise = max(variance, self._noise or 0.0)
        limit = VISIBLE if self.is_occluded else OCCLUDED
        self.is_occluded = distance**2 > limit**2 * noise
        memory = SLOW_MEMORY if self.is_occluded else MEMORY
        before = variance if self._noise is None else self._noise
        self._noise = before + (distance**2 - before) / memory
        return self.is_occluded


class SteplessCorrection:
    """The Kinect's correction of one link's IMU, which changes by little at once."""

    def __init__(self) -> None:
        self._correction: FloatArray | None = None  # (3, 3) in map

    def apply(self, R_kinect: FloatArray, R_imu: FloatArray, R_fused: FloatArray) -> FloatArray:
        """What goes out for a link.

        Args:
            R_kinect: The Kinect's rotation, where all begins, shape (3, 3).
            R_imu: The IMU's rotation, shape (3, 3).
            R_fused: The mean of both that the weights call for, shape (3, 3).
        """
        before = R_kinect @ R_imu.T if self._correction is None else self._correction
        step = np.asarray(Rotation.from_matrix(R_fused @ R_imu.T @ before.T).as_rotvec())
        size = float(np.linalg.norm(step))
        if size > LARGEST_STEP:
            step = step * (LARGEST_STEP / size)
        self._correction = rotation_from_vector(step) @ before
        return np.asarray(self._correction @ R_imu)
