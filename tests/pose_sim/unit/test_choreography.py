import numpy as np
import pytest

from pose_core.api import joint_angles, load_body_model
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_sim.angles import true_joint_angles
from pose_sim.body import Body
from pose_sim.choreography import CHOREOGRAPHIES, compose, plan
from pose_sim.occlusion import hidden
from pose_sim.timeline import AngleTimeline

NAMES = tuple(CHOREOGRAPHIES)


@pytest.fixture(scope="module")
def motions():
    return {name: compose(name, 40.0, 5, heading=0.7) for name in NAMES}


def degrees(motion, name):
    return np.degrees(true_joint_angles(motion)[name])


@pytest.mark.parametrize("name", NAMES)
def test_it_begins_with_two_seconds_of_standing_still_in_the_neutral_pose(motions, name):
    motion = motions[name]
    still = motion.times <= 2.0
    angles = joint_angles(motion.pose.joints[still])
    assert np.allclose(list(angles.values()), 0.0, atol=1e-6)
    assert np.ptp(motion.pose.joints[still], axis=0).max() < 1e-9


def largest_step_of_acceleration(timeline, rate):
    times = np.arange(int(30.0 * rate)) / rate
    channels = timeline.evaluate(times)
    accelerations = np.diff(list(channels.values()), 2, axis=1) * rate**2
    return np.abs(np.diff(accelerations, axis=1)).max(axis=1), np.abs(accelerations).max()


@pytest.mark.parametrize("name", NAMES)
def test_joint_angles_are_twice_continuously_differentiable(name):
    """On a grid four times as fine the steps of a continuous acceleration are a quarter."""
    timeline = AngleTimeline(Body(), np.random.default_rng(5))
    plan(CHOREOGRAPHIES[name], 30.0, timeline)
    coarse, _ = largest_step_of_acceleration(timeline, 500.0)
    fine, largest = largest_step_of_acceleration(timeline, 2000.0)
    assert np.all(fine <= 0.35 * coarse + 0.01)
    assert largest < 400.0  # [rad/s^2]


@pytest.mark.parametrize("name", NAMES)
def test_feet_neither_sink_into_the_floor_nor_float(motions, name):
    contacts = motions[name].pose.contacts[..., 2]
    assert contacts.min() > -0.006
    if "jump" not in name:
        assert contacts.min(axis=1).max() < 0.001


@pytest.mark.parametrize("name", NAMES)
def test_the_subject_stays_about_where_it_began_unless_it_walks(motions, name):
    pelvis = motions[name].pose.origins["pelvis"]
    way = np.linalg.norm(pelvis[:, :2] - pelvis[0, :2], axis=1).max()
    if name == "walk_about":
        assert 0.7 < way < 1.0
    else:
        assert way < 0.4


def test_a_foot_that_bears_the_body_does_not_slide(motions):
    motion = motions["leg_lift_march"]
    heights = motion.pose.contacts[..., 2]
    velocity = np.gradient(motion.pose.contacts, motion.times, axis=0)
    left_bears = heights[:, 2:].min(axis=1) > 0.05  # the right foot is in the air
    assert left_bears.sum() > 300
    assert np.linalg.norm(velocity[left_bears, 0, :2], axis=1).max() < 0.05  # [m/s]


def test_in_a_jump_the_hips_fall_freely_while_both_feet_are_in_the_air(motions):
    motion = motions["leg_lift_jump"]
    airborne = motion.pose.contacts[..., 2].min(axis=1) > 0.02
    assert airborne.sum() > 50
    height = motion.pose.origins["pelvis"][:, 2]
    acceleration = np.gradient(np.gradient(height, motion.times), motion.times)
    assert np.allclose(acceleration[airborne], -9.80665, atol=0.05)


def test_the_march_lifts_the_legs_to_the_side_and_then_the_knees(motions):
    motion = motions["leg_lift_march"]
    for side in ("left", "right"):
        assert degrees(motion, f"{side}_hip_abduction").max() > 28.0
        assert degrees(motion, f"{side}_hip_flexion").max() > 45.0
        assert degrees(motion, f"{side}_knee_flexion").max() > 65.0


def test_squats_bend_both_knees_deeply_and_alike(motions):
    left, right = (degrees(motions["squats"], f"{s}_knee_flexion") for s in ("left", "right"))
    assert left.max() > 85.0
    assert right.max() > 85.0
    late = motions["squats"].times > 18.0
    assert np.abs(left - right)[late].max() < 3.0


def test_arm_raises_reach_overhead(motions):
    joints = motions["arm_raises"].pose.joints
    assert (joints[:, JOINT_INDEX["left_hand"], 2] - joints[:, JOINT_INDEX["head"], 2]).max() > 0.2


def test_a_bow_bends_the_waist_as_well_as_the_hips(motions):
    assert degrees(motions["bow"], "waist_flexion").max() > 35.0
    assert degrees(motions["bow"], "left_hip_flexion").max() > 20.0


def test_turns_go_to_a_quarter_on_both_sides(motions):
    motion = compose("turn", 60.0, 5)
    yaw = np.degrees(motion.angles["pelvis_yaw"])
    assert yaw.max() == pytest.approx(90.0, abs=1.0)
    assert yaw.min() == pytest.approx(-90.0, abs=1.0)


def test_twisting_turns_the_shoulders_against_the_pelvis_both_ways(motions):
    motion = motions["twisting"]
    twist = degrees(motion, "waist_rotation")[motion.times > 17.0]
    assert twist.max() > 30.0
    assert twist.min() < -30.0


def test_dance_turns_by_60_degrees_and_waves_overhead(motions):
    motion = compose("dance", 60.0, 5)
    yaw = np.degrees(motion.angles["pelvis_yaw"])
    assert yaw.max() > 55.0
    assert yaw.min() < -55.0
    joints = motion.pose.joints
    for side in ("left", "right"):
        hand, head = joints[:, JOINT_INDEX[f"{side}_hand"]], joints[:, JOINT_INDEX["head"]]
        assert (hand - head)[:, 2].max() > 0.2
    assert degrees(motion, "waist_flexion").max() > 25.0


def test_kicks_go_to_the_front_and_to_the_side_with_a_stretched_knee(motions):
    motion = motions["kicks"]
    for side in ("left", "right"):
        knee = degrees(motion, f"{side}_knee_flexion")
        assert (degrees(motion, f"{side}_hip_flexion")[knee < 30.0]).max() > 65.0
        assert (degrees(motion, f"{side}_hip_abduction")[knee < 30.0]).max() > 40.0
        foot = motion.pose.joints[:, JOINT_INDEX[f"{side}_foot"]]
        assert np.linalg.norm(np.gradient(foot, motion.times, axis=0), axis=1).max() > 3.0  # [m/s]


def test_walking_with_turns_goes_right_round_to_both_sides():
    yaw = np.degrees(compose("walk_turns", 60.0, 5).angles["pelvis_yaw"])
    assert yaw.max() == pytest.approx(360.0, abs=1.0)
    assert yaw.min() < 0.0


def test_crouching_behind_an_arm_hides_joints_of_the_trunk_from_the_sensor_in_front(motions):
    motion = compose("crouch_behind_arm", 40.0, 5, place=(2.2, 0.0), heading=np.pi)
    late = motion.times > 17.0
    blocked = hidden(motion.pose.joints[late], np.array([0.0, 0.0, 1.3]), 1.75) > 0.5
    still = hidden(motion.pose.joints[:1], np.array([0.0, 0.0, 1.3]), 1.75) > 0.5
    trunk = [JOINT_INDEX[name] for name in ("head", "neck", "torso")]
    assert not still[:, trunk].any()
    assert blocked[:, trunk].any(axis=1).mean() > 0.2
    assert motion.angles["left_knee_flexion"].max() > np.radians(65.0)


def test_reaching_moves_the_shoulders_by_centimetres_against_the_trunk(motions):
    motion = motions["reach"]
    late = motion.times > 17.0
    for side in ("left", "right"):
        shoulder = motion.pose.origins[f"{side}_upper_arm"] - motion.pose.origins["torso"]
        in_trunk = np.einsum("nij,ni->nj", motion.pose.rotations["torso"], shoulder)
        moved = np.linalg.norm(in_trunk[late] - in_trunk[0], axis=1)
        assert 0.06 < moved.max() < 0.14  # [m]


def test_true_angles_have_the_names_of_the_27_dof_model_and_never_jump(motions):
    for name, motion in motions.items():
        angles = true_joint_angles(motion)
        assert tuple(angles) == load_body_model("default").angle_names
        assert len(angles) == 21
        for angle, values in angles.items():
            assert np.abs(np.diff(values)).max() < 0.2, (name, angle)


def test_true_angles_are_those_of_the_joints(motions):
    motion = motions["kicks"]
    true, measured = true_joint_angles(motion), joint_angles(motion.pose.joints)
    for name in ("left_knee_flexion", "right_hip_abduction", "left_elbow_flexion"):
        assert true[name] == pytest.approx(measured[name], abs=1e-6)


def test_the_same_seed_moves_alike_and_another_differs():
    first, again, other = (compose("squats", 20.0, seed).pose.joints for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert np.abs(first - other).max() > 0.02


def test_the_subject_begins_where_it_is_put():
    motion = compose("bow", 6.0, 1, place=(2.0, -1.0), heading=np.pi / 2)
    joints = motion.pose.joints[0]
    middle = 0.5 * (joints[JOINT_INDEX["left_hip"]] + joints[JOINT_INDEX["right_hip"]])
    assert np.allclose(middle[:2], (2.0, -1.0))
    left = joints[JOINT_INDEX["left_hip"]] - joints[JOINT_INDEX["right_hip"]]
    assert left[0] < -0.1  # it looks along y, so its left is -x


def test_an_unknown_choreography_is_refused_with_the_ones_there_are():
    with pytest.raises(InputError, match=r"unknown choreography 'moonwalk': expected leg_lift"):
        compose("moonwalk", 30.0, 1)


@pytest.mark.parametrize("duration", [2.0, -1.0, float("nan")])
def test_a_duration_too_short_to_stand_still_is_refused(duration):
    with pytest.raises(InputError, match="too short"):
        compose("bow", duration, 1)
