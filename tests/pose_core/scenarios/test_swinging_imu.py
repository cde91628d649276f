"""An IMU on a loose strap is believed less, and named (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from imu_session import imu_session, uses_and_spread
from scipy.spatial.transform import Rotation
from worn_imus import START_NS

LOOSE = "left_thigh"
SWING = np.array([0.25, 0.0, 0.2])  # [rad] about the sensor's axes
FREQUENCY = 12.0  # [rad/s]
JUDGED_S = 12.0
ANGLES = ("left_hip_flexion", "left_hip_abduction", "left_hip_rotation", "left_knee_flexion")


def swinging(sample):
    """A sample of a sensor that swings; its gyroscope measures that, too."""
    if sample.segment != LOOSE:
        return sample
    phase = FREQUENCY * (sample.stamp_ns - START_NS) * 1e-9
    swing = Rotation.from_rotvec(SWING * np.sin(phase))
    rate = swing.inv().apply(sample.angular_velocity) + SWING * FREQUENCY * np.cos(phase)
    orientation = (Rotation.from_quat(sample.orientation) * swing).as_quat()
    return replace(sample, orientation=orientation, angular_velocity=rate)


@pytest.fixture(scope="module")
def session():
    return imu_session(26.0)


@pytest.fixture(scope="module")
def swung(session):
    return uses_and_spread(session, [swinging(sample) for sample in session[3]], ANGLES, JUDGED_S)


def test_only_the_swinging_imu_is_named(swung):
    uses, _ = swung
    assert [use.segment for use in uses.values() if "times the usual noise" in str(use)] == [LOOSE]
    assert uses[LOOSE].noise > 10.0


def test_the_limb_is_hardly_worse_than_without_the_swinging_imu(session, swung):
    _, without = uses_and_spread(
        session, [sample for sample in session[3] if sample.segment != LOOSE], ANGLES, JUDGED_S
    )
    assert swung[1] < 1.1 * without
