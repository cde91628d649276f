"""The headings of two IMUs drift, as by gyroscopes' biases: this is corrected (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from imu_session import imu_session, uses_and_spread
from scipy.spatial.transform import Rotation
from worn_imus import START_NS

DRIFTS = {"left_thigh": np.radians(2.0), "right_forearm": np.radians(-2.0)}  # [rad/s]
JUDGED_S = 20.0
ANGLES = ("left_hip_rotation", "left_hip_abduction", "right_elbow_flexion")


def drifting(sample):
    """A sample of a sensor without magnetometer, whose gyroscope has a bias about the vertical."""
    rate = np.array([0.0, 0.0, DRIFTS.get(sample.segment, 0.0)])
    orientation = Rotation.from_quat(sample.orientation)
    turned = Rotation.from_rotvec(rate * (sample.stamp_ns - START_NS) * 1e-9) * orientation
    biased = sample.angular_velocity + orientation.inv().apply(rate)
    return replace(sample, orientation=turned.as_quat(), angular_velocity=biased)


@pytest.fixture(scope="module")
def session():
    return imu_session(40.0)


@pytest.fixture(scope="module")
def drifted(session):
    return uses_and_spread(session, [drifting(sample) for sample in session[3]], ANGLES, JUDGED_S)


def test_drifts_are_found_and_only_those_imus_are_named(drifted):
    uses, _ = drifted
    named = {segment for segment, use in uses.items() if "its heading drifts by" in str(use)}
    assert named == set(DRIFTS)
    for segment, use in uses.items():
        assert use.heading_drift == pytest.approx(-DRIFTS.get(segment, 0.0), abs=np.radians(0.4))


def test_the_limbs_are_hardly_worse_than_with_headings_that_do_not_drift(session, drifted):
    _, without = uses_and_spread(session, session[3], ANGLES, JUDGED_S)
    assert drifted[1] < 1.1 * without
