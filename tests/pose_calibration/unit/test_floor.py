"""The world frame from standing and walking people."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from walking_person import ANKLE, frames, person_at, sensor_pose

from pose_calibration.floor.floor import (
    AHEAD_OF_ANKLES_M,
    FEET,
    KNOWN_MOUNTING,
    LEVEL_SENSOR,
    MASS_SHARES,
    UPRIGHT_BODY,
    KnownMounting,
    estimate_floor,
)
from pose_calibration.floor.gravity import Gravity
from pose_core.joints import JOINT_INDEX, JOINTS

LEGS = ("hip", "knee", "foot")
UPPER_BODY = [index for name, index in JOINT_INDEX.items() if name.split("_")[-1] not in LEGS]
FEET_JOINTS = [JOINT_INDEX["left_foot"], JOINT_INDEX["right_foot"]]


def view(T, **options):
    options = {"noise": 0.01, **options}
    some = frames(poses={"only": T}, **options)
    return np.array([frame.samples["only"].positions for frame in some])


def stepping(T):
    """A view of somebody who walks and puts one foot in front of the other."""
    positions = view(T)
    size = 0.3 * np.sin(0.2 * np.arange(len(positions)))
    for sign, index in zip((1.0, -1.0), FEET_JOINTS, strict=True):
        positions[:, index] += sign * np.outer(size, T[0, :3])
    return positions


def up_error_deg(estimate, T):
    return float(np.degrees(np.arccos(np.clip(estimate[2, :3] @ T[2, :3], -1.0, 1.0))))


@pytest.mark.parametrize("tilt", [-20.0, 0.0, 12.0, 35.0])
@pytest.mark.parametrize("roll", [-8.0, 0.0])
def test_a_walking_person_gives_vertical_and_height(tilt, roll):
    T = sensor_pose(0.0, 0.0, 1.4, 0.0, tilt, roll)
    floor = estimate_floor(view(T))
    assert up_error_deg(floor.T_map_reference, T) < 0.5
    assert floor.height == pytest.approx(1.4, abs=0.03)
    assert floor.source == f"{UPRIGHT_BODY}, {FEET}"


def test_walking_feet_are_named_once_as_a_source():
    T = sensor_pose(0.0, 0.0, 1.4, 0.0, 10.0, 0.0)
    source = f"{UPRIGHT_BODY}, {FEET}, body-worn IMUs"
    rough = Gravity(up=T[2, :3], stddev=float(np.radians(8.0)), source=source)
    assert estimate_floor(view(T), gravity=rough).source == source
    rough = replace(rough, source=UPRIGHT_BODY)
    assert estimate_floor(view(T), gravity=rough).source == f"{UPRIGHT_BODY}, {FEET}"


def test_a_sensor_that_hangs_upside_down_gives_vertical_and_height():
    T = sensor_pose(0.0, 0.0, 2.2, 0.0, 25.0, 175.0)
    floor = estimate_floor(view(T))
    assert up_error_deg(floor.T_map_reference, T) < 0.5
    assert floor.height == pytest.approx(2.2, abs=0.03)


def test_the_world_frame_looks_along_the_sensor_from_the_floor_below_it():
    T = sensor_pose(3.0, -2.0, 1.4, 130.0, 12.0)  # where it stands in the room does not matter
    person = np.array([person_at(t / 10.0) for t in range(200)])
    positions = (person - [2.5, 0.0, 0.0]) @ T[:3, :3] + [0.0, -0.3, 3.0]
    estimate = estimate_floor(positions).T_map_reference
    np.testing.assert_allclose(estimate[:2, 3], 0.0, atol=1e-12)
    forward = estimate[:3, :3] @ [0.0, 0.0, 1.0]
    assert forward[0] > 0.9
    assert forward[1] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(estimate[:3, :3] @ estimate[:3, :3].T, np.eye(3), atol=1e-9)
    assert np.linalg.det(estimate[:3, :3]) == pytest.approx(1.0)


def test_standing_feet_are_an_ankle_s_height_above_the_floor():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0, 5.0)
    positions = view(T, noise=0.0)
    estimate = estimate_floor(positions).T_map_reference
    feet = positions[:, FEET_JOINTS] @ estimate[:3, :3].T + estimate[:3, 3]
    np.testing.assert_allclose(feet[..., 2], ANKLE, atol=0.003)


def test_standing_on_one_spot_relies_on_the_body_alone():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0, 10.0)
    floor = estimate_floor(view(T, walks=False))
    assert floor.source == UPRIGHT_BODY
    assert up_error_deg(floor.T_map_reference, T) < 1.0
    assert floor.height == pytest.approx(1.2, abs=0.05)


def test_somebody_who_bends_forwards_in_balance_does_not_tilt_the_vertical():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T, walks=False, noise=0.0)
    bend = Rotation.from_euler("x", 40.0, degrees=True)  # towards the sensor
    shares = np.array([MASS_SHARES.get(name.split("_")[-1], 0.0) for name in JOINTS])
    for body in positions:
        hip = body[[JOINT_INDEX["left_hip"], JOINT_INDEX["right_hip"]]].mean(axis=0)
        body[UPPER_BODY] = bend.apply(body[UPPER_BODY] - hip) + hip
        ankles = body[FEET_JOINTS].mean(axis=0)
        up = ankles[1] - body[:, 1]
        missing = ankles[2] - AHEAD_OF_ANKLES_M - shares @ body[:, 2]
        body[:, 2] += missing * up / (shares @ up)  # the hips move back
    assert up_error_deg(estimate_floor(positions).T_map_reference, T) < 0.5


def test_somebody_who_stands_on_one_leg_is_in_balance_above_that_foot():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T, walks=False, noise=0.0)
    raised = Rotation.from_euler("x", -70.0, degrees=True)  # towards the sensor
    shares = np.array([MASS_SHARES.get(name.split("_")[-1], 0.0) for name in JOINTS])
    left_leg = [JOINT_INDEX["left_knee"], JOINT_INDEX["left_foot"]]
    for body in positions:
        hip = body[JOINT_INDEX["left_hip"]]
        body[left_leg] = raised.apply(body[left_leg] - hip) + hip
        ankle = body[JOINT_INDEX["right_foot"]]
        up = ankle[1] - body[:, 1]
        for axis, ahead in ((0, 0.0), (2, -AHEAD_OF_ANKLES_M)):
            missing = ankle[axis] + ahead - shares @ body[:, axis]
            body[:, axis] += missing * up / (shares @ up)
    assert up_error_deg(estimate_floor(positions).T_map_reference, T) < 2.0


def test_walking_feet_correct_a_person_who_stoops():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T)
    heights = (1.2 - positions[..., 1] - ANKLE)[..., None]
    stooped = positions + heights * np.sin(np.radians(4.0)) * [0.0, 0.0, -1.0]
    body_alone = estimate_floor(stooped - stooped[:, FEET_JOINTS].mean(axis=1, keepdims=True))
    corrected = estimate_floor(stooped)
    assert up_error_deg(body_alone.T_map_reference, T) > 3.0
    assert up_error_deg(corrected.T_map_reference, T) < up_error_deg(body_alone.T_map_reference, T)
    assert corrected.up_stddev < body_alone.up_stddev


def test_feet_of_a_climbing_person_do_not_tilt_the_vertical():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T)
    distance = positions[:, FEET_JOINTS, 2].mean(axis=1)
    steps = np.floor((distance - distance.min()) / 0.4)  # 0.3 m high, 0.4 m apart
    positions[..., 1] -= 0.3 * steps[:, None]
    found = estimate_floor(positions)
    assert up_error_deg(found.T_map_reference, T) < 3.0
    assert found.up_stddev > np.radians(1.9)
    assert abs(found.height - 1.2) < 2.0 * found.height_stddev


def test_a_jump_and_swinging_feet_do_not_lift_the_floor():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T)
    positions[::5] += [0.0, -0.35, 0.0]  # in the air
    positions[1::2, FEET_JOINTS[0]] += [0.0, -0.2, 0.0]
    assert estimate_floor(positions).height == pytest.approx(1.2, abs=0.03)


def test_a_lying_person_does_not_rotate_map():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T)
    lying = positions[:, :, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    both = np.concatenate([positions, lying])
    assert up_error_deg(estimate_floor(both).T_map_reference, T) < 1.0


def test_nan_and_bent_poses_are_passed_over():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0, 10.0)
    positions = view(T)
    positions[::3, JOINT_INDEX["neck"]] = np.nan
    positions[1::3, JOINT_INDEX["left_knee"]] += [0.0, 0.0, -0.4]  # bent
    floor = estimate_floor(positions)
    assert up_error_deg(floor.T_map_reference, T) < 0.6


def test_without_an_upright_person_the_sensor_is_taken_as_level():
    floor = estimate_floor(np.full((50, 15, 3), np.nan))
    assert floor.source == LEVEL_SENSOR
    np.testing.assert_allclose(floor.T_map_reference[2, :3], [0.0, -1.0, 0.0])
    assert floor.up_stddev == pytest.approx(np.radians(10.0))
    assert floor.height_stddev == np.inf


def test_resting_feet_do_not_tilt_a_sensor_that_is_taken_as_level():
    """A seated person, whose tracker draws one foot higher than the other."""
    T = sensor_pose(0.0, 0.0, 1.2, 0.0, 0.0)
    positions = np.full((50, 15, 3), np.nan)
    rng = np.random.default_rng(1)
    feet_map = np.array([[2.0, 0.15, 0.08], [2.3, -0.15, 0.16]])
    feet = (feet_map - T[:3, 3]) @ T[:3, :3]
    feet = feet + rng.normal(0.0, 0.01, (50, 2, 3))
    positions[:, [JOINT_INDEX["left_foot"], JOINT_INDEX["right_foot"]]] = feet
    floor = estimate_floor(positions)
    assert floor.source == LEVEL_SENSOR
    assert up_error_deg(floor.T_map_reference, T) < 0.1
    assert floor.up_stddev == pytest.approx(np.radians(10.0), rel=0.05)
    assert abs(floor.height - 1.2) < 2.0 * floor.height_stddev


def test_feet_that_a_seated_person_s_tracker_guesses_do_not_tilt_a_sensor_taken_as_level():
    """They wander by half a metre over a slope, in several cells of the floor."""
    T = sensor_pose(0.0, 0.0, 1.2, 0.0, 0.0)
    positions = np.full((600, 15, 3), np.nan)
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.28, 0.28, (2, 600))
    foot_map = np.stack([2.0 + x, y, 0.15 + 0.2 * x], axis=1)
    for name in ("left_foot", "right_foot"):
        seen = (foot_map - T[:3, 3]) @ T[:3, :3]
        positions[:, JOINT_INDEX[name]] = seen + rng.normal(0.0, 0.01, (600, 3))
    floor = estimate_floor(positions)
    assert floor.source == LEVEL_SENSOR
    assert up_error_deg(floor.T_map_reference, T) < 0.1


def test_gross_errors_of_resting_feet_do_not_tilt_the_vertical():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    rng = np.random.default_rng(3)
    feet_map = np.array([2.0, 0.0, 0.07]) + rng.normal(0.0, 0.01, (1000, 2, 3))
    wrong = rng.permutation(1000)[:30]
    off = rng.uniform(-0.7, 0.7, (30, 3))
    off[:, 2] = 0.3 * off[:, 0] - np.abs(rng.normal(0.0, 0.05, 30))  # as if on a slope
    feet_map[wrong, 0] += off
    positions = np.full((1000, 15, 3), np.nan)
    positions[:, FEET_JOINTS] = (feet_map - T[:3, 3]) @ T[:3, :3]
    found = estimate_floor(positions)
    assert up_error_deg(found.T_map_reference, T) < 0.5
    assert found.up_stddev > np.radians(8.0)
    assert abs(found.height - 1.2) < 2.0 * found.height_stddev


def test_a_known_mounting_overrides_the_estimate():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0, 10.0)
    known = KnownMounting(tilt=np.radians(14.0), height=2.0)
    floor = estimate_floor(view(T), known)
    assert floor.source == KNOWN_MOUNTING
    assert floor.tilt == pytest.approx(np.radians(14.0), abs=1e-6)
    assert floor.height == 2.0
    assert floor.height_stddev == 0.0


def test_a_known_tilt_leaves_the_height_to_the_feet():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0, 10.0)
    floor = estimate_floor(view(T), KnownMounting(tilt=np.radians(10.0)))
    assert floor.height == pytest.approx(1.2, abs=0.02)
    assert floor.tilt == pytest.approx(np.radians(10.0), abs=1e-6)


@pytest.mark.parametrize("roll", [-90.0, 65.0, 82.0, 100.0])
def test_before_a_sensor_on_its_side_a_walking_person_gives_the_vertical(roll):
    T = sensor_pose(0.0, 0.0, 1.4, 0.0, 12.0, roll)
    floor = estimate_floor(stepping(T))
    assert up_error_deg(floor.T_map_reference, T) < 0.5
    assert floor.height == pytest.approx(1.4, abs=0.03)
    assert floor.source == f"{UPRIGHT_BODY}, {FEET}"


def lying_for_long(T):
    positions = np.repeat(view(T, walks=False), 4, axis=0)
    hips = positions[:, [JOINT_INDEX["left_hip"]]]
    tipped_over = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0])
    return (positions - hips) @ tipped_over.as_matrix().T + hips


def test_somebody_who_mostly_lies_and_never_walks_says_little_about_the_vertical():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    both = np.concatenate([view(T, walks=False), lying_for_long(T)])
    floor = estimate_floor(both)
    assert up_error_deg(floor.T_map_reference, T) < 2.0
    assert floor.up_stddev > np.radians(8.0)


def test_somebody_who_lies_and_sometimes_walks_is_upright_when_they_walk():
    T = sensor_pose(0.0, 0.0, 2.6, 0.0, 75.0)  # steeply from above
    lying = lying_for_long(T)
    both = np.concatenate([stepping(T), lying])
    floor = estimate_floor(both)
    assert up_error_deg(floor.T_map_reference, T) < 5.0


@pytest.mark.parametrize(
    ("rolls", "spreads_legs", "shifts"),
    [(0.0, 0.0, 0.0), (0.8, 0.0, 0.0), (0.0, 0.3, 0.0), (0.8, 0.3, 0.6)],
)
def test_somebody_who_lies_and_moves_says_nothing_about_the_vertical(rolls, spreads_legs, shifts):
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T, walks=False)
    lying = positions @ Rotation.from_rotvec([0.0, 0.0, np.pi / 2]).as_matrix().T
    swing = np.sin(0.2 * np.arange(len(lying)))[:, None, None]
    lying = lying + swing * [shifts, 0.0, rolls]  # along the body, and across it
    for sign, index in zip((1.0, -1.0), FEET_JOINTS, strict=True):
        lying[:, index] += sign * spreads_legs * swing[:, 0] * [0.0, 0.0, 1.0]
    assert LEVEL_SENSOR in estimate_floor(lying).source


@pytest.mark.parametrize("tilt", [80.0, 90.0])
def test_below_a_reference_that_looks_down_x_points_to_its_images_upper_edge(tilt):
    known = KnownMounting(tilt=np.radians(tilt))
    floor = estimate_floor(np.full((1, 15, 3), np.nan), known)
    assert floor.T_map_reference[:3, :3] @ [0.0, -1.0, 0.0] == pytest.approx(
        [np.sin(np.radians(tilt)), 0.0, np.cos(np.radians(tilt))], abs=1e-9
    )


def test_a_seated_person_whose_tracker_errs_is_not_in_balance():
    T = sensor_pose(0.0, 0.0, 1.2, 0.0)
    positions = view(T, walks=False, noise=0.0)
    for side in ("left", "right"):
        hip = positions[:, JOINT_INDEX[f"{side}_hip"]]
        knee = hip + [0.0, 0.12, -0.4]  # towards the sensor
        positions[:, JOINT_INDEX[f"{side}_knee"]] = knee
        positions[:, JOINT_INDEX[f"{side}_foot"]] = knee + [0.0, 0.42, -0.03]
    positions += np.random.default_rng(2).normal(0.0, 0.1, positions.shape)
    assert LEVEL_SENSOR in estimate_floor(positions).source
