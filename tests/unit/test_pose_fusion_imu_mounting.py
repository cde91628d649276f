"""IMUs whose mounting a calibration has found (synthetic)."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.imu.alignment import NEUTRAL_DURATION_NS, ImuAlignment
from pose_core.imu.heading import HeadingAnchor
from pose_core.imu.mounting import Mounting
from pose_core.imu.track import ImuState, states_of
from pose_core.kernels.alignment import Sights

STEP_NS = 33_000_000
ANGLES = [f"{side}_{name}" for side in ("left", "right") for name in ("hip", "knee", "a", "b", "c")]
M = Rotation.from_rotvec([0.3, -0.4, 1.2])  # R_sensor_segment
MOUNTING = Mounting(R_sensor_segment=M.as_matrix(), stddev=np.full(3, 0.03), residual=0.05)


def state(R_map_segment, heading):
    R_world_sensor = Rotation.from_euler("z", -heading) * R_map_segment * M.inv()
    return ImuState(
        R_world_sensor=R_world_sensor.as_matrix(),
        angular_velocity=np.zeros(3),
        stddev=np.full(3, 0.02),
    )


def observe(alignment, k, segment, heading, *, neutral=False):
    alignment.observe(
        k * STEP_NS,
        states_of({"left_thigh": state(segment, heading)}),
        Sights(segment.as_matrix()[None, :, 2].copy(), np.full((1, 3), np.nan), np.zeros(1)),
        dict.fromkeys(ANGLES, 0.0 if neutral else 1.0),
        float(segment.as_euler("ZYX")[0]),
    )


def error_deg(alignment, segment, heading):
    reading = alignment.readings(states_of({"left_thigh": state(segment, heading)}))["left_thigh"]
    return np.degrees((Rotation.from_matrix(reading.R_map_segment).inv() * segment).magnitude())


@pytest.fixture
def alignment():
    alignment = ImuAlignment()
    alignment.use_mountings({"left_thigh": MOUNTING})
    return alignment


@pytest.mark.parametrize("heading_deg", [0.0, 90.0, 180.0, -90.0])
def test_without_any_neutral_stand_a_leaning_segment_is_read_right(alignment, heading_deg):
    heading = np.radians(heading_deg)
    for k in range(60):
        segment = Rotation.from_euler("ZYX", [0.8, -0.6 * np.sin(0.2 * k), 0.1])
        observe(alignment, k, segment, heading)
    assert alignment.known_segments == ["left_thigh"]
    assert error_deg(alignment, segment, heading) < 0.1


@pytest.mark.parametrize("heading_deg", [0.0, 90.0, 180.0, -90.0])
def test_a_neutral_stand_tells_the_heading_before_anything_leans(alignment, heading_deg):
    heading, standing = np.radians(heading_deg), Rotation.from_euler("z", 0.8)
    for k in range(NEUTRAL_DURATION_NS // STEP_NS + 3):
        observe(alignment, k, standing, heading, neutral=True)
    assert error_deg(alignment, standing, heading) < 0.1
    leaning = Rotation.from_euler("ZYX", [1.5, -0.7, 0.2])
    assert error_deg(alignment, leaning, heading) < 0.1


def test_what_cameras_lastingly_see_beside_is_not_taken_for_heading():
    anchor = HeadingAnchor(is_mounting_known=True)
    anchor.observe_standing(0.5, np.radians(4.0))
    beside = np.radians(8.0)
    axis = np.array([np.cos(0.5 + beside), np.sin(0.5 + beside), 0.0])
    for _ in range(300):
        anchor.predict(0.03)
        anchor.observe_lean(0.03, np.array([1.0, 0.0, 0.0]), axis)
    assert abs(anchor.heading - 0.5) < 0.5 * beside
    assert anchor.neutral_heading == 0.0


def test_segments_that_the_calibration_does_not_name_wait_for_a_neutral_stand(alignment):
    assert alignment.awaits_neutral(("right_thigh",))
    assert not alignment.readings(states_of({"right_thigh": state(Rotation.identity(), 0.0)}))
