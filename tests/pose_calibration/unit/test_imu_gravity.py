"""The vertical from IMUs on limbs that a camera tracks (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_calibration.clocks.motion_track import Track
from pose_calibration.inertial.imu_gravity import BODY_IMUS, gravity_from_imus, searched_gravity
from pose_calibration.inertial.imu_motion import Views, measure_imu_delay
from pose_calibration.inertial.vertical_search import search_vertical
from pose_core.joints import JOINT_INDEX, JOINTS, SEGMENT_ENDS

UP = np.array([0.10, -0.98, -0.17]) / np.linalg.norm([0.10, -0.98, -0.17])
SEGMENTS = ("left_upper_arm", "right_upper_arm", "left_thigh", "right_thigh")
SEEN_WRONG = np.radians(3.0)
PRIOR = np.radians(5.0)


def swinging(delay_s=0.0, moves=True, noise=0.005, turning=0.0):
    """A camera's view of four swinging limbs, and what IMUs on them feel ``delay_s`` later."""
    rng = np.random.default_rng(4)
    camera, imu = np.arange(0.0, 30.0, 1 / 30), np.arange(-1.0, 31.0, 0.02)
    joints = np.full((len(camera), len(JOINTS), 3), np.nan)
    verticals = {}
    for index, segment in enumerate(SEGMENTS):

        def limb(times, index=index):
            """It swings forwards and sideways: about one axis alone, the vertical stays open."""
            size = 0.7 if moves else 0.0
            forwards = size * np.sin((1.5 + 0.3 * index) * times + index)
            sideways = size * np.sin((0.9 + 0.2 * index) * times)
            swing = Rotation.from_rotvec(np.stack([forwards, 0.0 * times, sideways], axis=1))
            return Rotation.from_rotvec(turning * np.outer(times, UP)) * swing

        hanging = np.array([0.0, 1.0, 0.0])
        start, end = (JOINT_INDEX[name] for name in SEGMENT_ENDS[segment])
        joints[:, start] = [0.2 * index, 0.0, 2.5]
        joints[:, end] = joints[:, start] + 0.35 * limb(camera).apply(hanging)
        alignment = Rotation.from_rotvec(rng.normal(size=3))
        verticals[segment] = Track(imu + delay_s, (limb(imu) * alignment).inv().apply(UP))
    joints += rng.normal(0.0, noise, joints.shape)
    return Track(camera, joints), verticals


def off_by(angle):
    return Rotation.from_rotvec([angle, 0.0, 0.5 * angle]).apply(UP)


def test_the_vertical_is_found_whatever_the_mountings():
    track, verticals = swinging()
    views = Views([track], off_by(SEEN_WRONG))
    found = gravity_from_imus(views, verticals, 0.0, PRIOR, "a guess")
    assert found is not None
    assert found.source == f"a guess, {BODY_IMUS}"
    error = float(np.arccos(found.up @ UP))
    assert error < np.radians(0.8)
    assert error < 3.0 * found.stddev
    assert found.stddev < 0.85 * PRIOR


def test_a_prior_that_all_limbs_contradict_is_left_out():
    track, verticals = swinging()
    views = Views([track], off_by(np.radians(20.0)))
    found = gravity_from_imus(views, verticals, 0.0, np.radians(2.0), "a guess")
    assert found is not None
    assert found.source == f"{BODY_IMUS}, not a guess"
    assert float(np.arccos(found.up @ UP)) < np.radians(2.0)


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 0.1, 1.0]])
def test_a_vertical_in_any_other_direction_is_searched(axis):
    track, verticals = swinging(turning=0.5)
    trunk = [JOINT_INDEX[name] for name in SEGMENT_ENDS["torso"]]
    track.values[:, trunk[1]] = 0.4 * UP
    track.values[:, trunk[0]] = 0.0
    nobody = Track(np.empty(0), np.empty((0, len(JOINTS), 3)))
    views = Views([track, nobody], np.array(axis))
    up = search_vertical(views, verticals, 0.5)
    assert up is not None
    assert float(np.arccos(up @ UP)) < np.radians(30.0)
    found = searched_gravity(replace(views, up=up), verticals, 0.0, "a guess")
    assert found.source == f"{BODY_IMUS}, not a guess"
    assert float(np.arccos(found.up @ UP)) < np.radians(2.0)


def test_a_vertical_that_explains_the_limbs_is_not_searched_again():
    track, verticals = swinging(turning=0.5)
    for up in (off_by(np.radians(15.0)), -UP):  # opposite inclinations are explained as well
        assert search_vertical(Views([track], up), verticals, 0.5) is None


def test_limbs_at_rest_do_not_improve_the_vertical():
    track, verticals = swinging(moves=False)
    views = Views([track], off_by(SEEN_WRONG))
    assert gravity_from_imus(views, verticals, 0.0, np.radians(1.0), "") is None


def test_without_imus_there_is_no_estimate():
    track, _ = swinging()
    assert gravity_from_imus(Views([track], UP), {}, 0.0, PRIOR, "") is None


@pytest.mark.parametrize("delay_s", [-0.42, 0.013, 0.31])
def test_the_delay_is_found_to_5_ms(delay_s):
    track, verticals = swinging(delay_s)
    found = measure_imu_delay(Views([track], UP), verticals, reach_s=0.5)
    assert found.estimate_s == pytest.approx(delay_s, abs=0.005)


def test_limbs_at_rest_determine_no_delay():
    track, verticals = swinging(0.1, moves=False, noise=0.001)
    assert measure_imu_delay(Views([track], UP), verticals, reach_s=0.5).stddev_s == np.inf
