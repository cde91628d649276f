from dataclasses import replace

import numpy as np
import pytest

from pose_core.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_sim.choreography import compose
from pose_sim.kinect_noise import CLEAN, HARD, TYPICAL
from pose_sim.scene import SceneParameters, sensor_poses, subject_place
from pose_sim.tracker_errors import tracked
from pose_sim.virtual_kinect import draw_body_bias, observe

SCENE = SceneParameters()
POSES = sensor_poses(SCENE)


@pytest.fixture(scope="module")
def motion():
    place, heading = subject_place(SCENE)
    return compose("leg_lift_march", 30.0, 4, place=place, heading=heading)


def watched(motion, parameters, sensor="left", seed=0):
    rng = np.random.default_rng(seed)
    return observe(
        motion,
        POSES[sensor],
        parameters,
        body_height=SCENE.body_height,
        body_bias=draw_body_bias(rng),
        common_lags=np.zeros(len(JOINTS)),
        rng=rng,
    )


def errors(motion, frames, sensor="left"):
    T = POSES[sensor]
    in_map = frames.positions @ T[:3, :3].T + T[:3, 3]
    return np.linalg.norm(in_map - motion.joints_at(frames.capture_s), axis=2)


def test_without_noise_it_measures_the_true_joints(motion):
    for sensor in POSES:
        frames = watched(motion, CLEAN, sensor)
        assert np.nanmax(errors(motion, frames, sensor)) < 1e-9


def test_the_person_stands_upright_before_the_facing_sensor(motion):
    first = watched(motion, CLEAN).positions[0]
    head, foot = first[JOINT_INDEX["head"]], first[JOINT_INDEX["left_foot"]]
    assert head[1] < foot[1] - 1.0  # optical y points down
    assert 1.8 < head[2] < 2.6
    # It faces the sensor: its left is on the sensor's right.
    assert first[JOINT_INDEX["left_hip"], 0] > first[JOINT_INDEX["right_hip"], 0]


def test_frames_come_at_30_hz_on_a_phase_of_their_own(motion):
    left, right = (watched(motion, CLEAN, seed=seed) for seed in (1, 2))
    for frames in (left, right):
        assert np.allclose(np.diff(frames.capture_s), 1.0 / 30.0, rtol=1e-3)
        assert len(frames.capture_s) == pytest.approx(900, abs=1)
    assert abs(left.capture_s[0] - right.capture_s[0]) > 1e-4


def test_each_sensor_has_a_clock_with_its_own_offset_and_drift(motion):
    parameters = replace(CLEAN, clock_drift=100.0)
    fits = []
    for seed in (1, 2):
        frames = watched(motion, parameters, seed=seed)
        fits.append(np.polyfit(frames.capture_s, frames.sensor_time_ns * 1e-9, 1))
    (slope_a, offset_a), (slope_b, offset_b) = fits
    assert 1e-6 < abs(slope_a - slope_b) < 1e-3
    assert abs(offset_a - offset_b) > 1.0


def test_frames_arrive_in_order_late_and_with_jitter(motion):
    frames = watched(motion, replace(TYPICAL, arrival_jitter=0.02))
    delay = frames.host_time_ns * 1e-9 - frames.capture_s
    assert np.all(np.diff(frames.host_time_ns) > 0)
    assert delay.min() >= TYPICAL.latency - 1e-6
    assert delay.std() > 0.005


def test_dropped_frames_leave_gaps(motion):
    frames = watched(motion, replace(CLEAN, dropped_share=0.2))
    assert len(frames.capture_s) == pytest.approx(720, abs=45)
    assert np.diff(frames.sensor_time_ns).max() > 1.9e9 / 30.0


def test_a_hidden_joint_is_inferred_and_further_off_than_one_in_view(motion):
    frames = watched(motion, replace(TYPICAL, wrongly_tracked=0.0), "right")
    off = errors(motion, frames, "right")
    inferred = frames.tracking_state == TrackingState.INFERRED
    tracked = frames.tracking_state == TrackingState.TRACKED
    assert inferred.sum() > 200
    assert off[inferred].mean() > 1.5 * off[tracked].mean()


def test_some_hidden_joints_are_wrongly_called_tracked(motion):
    never = watched(motion, replace(CLEAN, wrongly_tracked=0.0), "right").tracking_state
    always = watched(motion, replace(CLEAN, wrongly_tracked=1.0), "right").tracking_state
    assert np.any(never == TrackingState.INFERRED)
    assert not np.any(always == TrackingState.INFERRED)


def test_a_hand_behind_the_trunk_is_not_tracked_and_off():
    """From the sensor aside, the far hand of a standing person is behind the trunk."""
    place, heading = subject_place(SCENE)
    standing = compose("leg_lift_march", 5.0, 4, place=place, heading=heading)
    no_offsets = {"joint_bias": 0.0, "pose_bias": 0.0, "flesh_offset": 0.0}
    frames = watched(standing, replace(TYPICAL, wrongly_tracked=0.0, **no_offsets), "right")
    still = frames.capture_s < 2.0
    hand = JOINT_INDEX["right_hand"]
    state = frames.tracking_state[still, hand]
    assert np.mean(state != TrackingState.TRACKED) > 0.9
    off = errors(standing, frames, "right")[still]
    assert np.nanmean(off[:, hand]) > 1.5 * np.nanmean(off[:, JOINT_INDEX["left_hand"]])


def test_a_joint_that_is_not_tracked_has_no_position(motion):
    frames = watched(motion, HARD)
    lost = frames.tracking_state == TrackingState.NOT_TRACKED
    assert lost.sum() > 20
    assert np.array_equal(np.isnan(frames.positions).all(axis=2), lost)


def test_white_noise_grows_with_depth(motion):
    near = watched(motion, replace(CLEAN, depth_noise=0.002))
    off = near.positions - watched(motion, CLEAN).positions
    assert off[..., 2].std() == pytest.approx(0.002 * 2.2**2, rel=0.25)
    assert np.abs(off[..., :2]).max() < 1e-9


def test_the_constant_bias_turns_with_the_body(motion):
    frames = watched(motion, replace(CLEAN, joint_bias=0.02))
    off = errors(motion, frames)
    assert off.std(axis=0).max() < 1e-6
    assert 0.005 < off.mean() < 0.08


def test_an_offset_follows_the_direction_of_the_limb(motion):
    frames = watched(motion, replace(CLEAN, pose_bias=0.02))
    off = errors(motion, frames)
    standing = frames.capture_s < 2.0
    assert off[standing].max() < 0.003
    assert off[:, JOINT_INDEX["left_knee"]].max() > 0.01
    assert off[:, JOINT_INDEX["head"]].max() < 1e-9


def test_an_arm_is_mistaken_as_a_whole(motion):
    def likeness(share):
        parameters = replace(CLEAN, wander_moving=0.03, arm_likeness=share, bone_stiffness=0.0)
        frames = watched(motion, parameters)
        true = watched(motion, CLEAN).positions
        elbow, hand = (
            frames.positions[:, JOINT_INDEX[f"left_{joint}"]]
            - true[:, JOINT_INDEX[f"left_{joint}"]]
            for joint in ("elbow", "hand")
        )
        return np.corrcoef(elbow.ravel(), hand.ravel())[0, 1]

    assert likeness(0.9) > 0.6
    assert abs(likeness(0.0)) < 0.3


def test_a_body_at_rest_has_smaller_errors_than_a_moving_one(motion):
    frames = watched(motion, TYPICAL)
    knee = frames.positions[:, JOINT_INDEX["left_knee"]]
    shin = np.linalg.norm(knee - frames.positions[:, JOINT_INDEX["left_foot"]], axis=1)
    still, moving = frames.capture_s < 2.0, frames.capture_s > 18.0
    assert np.nanstd(shin[still]) < 0.01
    assert np.nanstd(shin[moving]) > 2.0 * np.nanstd(shin[still])


def test_the_same_seed_gives_the_same_measurements(motion):
    first, again, other = (watched(motion, TYPICAL, seed=seed).positions for seed in (1, 1, 2))
    assert np.array_equal(first, again, equal_nan=True)
    assert first.shape[1:] == (len(JOINTS), 3)
    assert not np.array_equal(first[:100], other[:100], equal_nan=True)


def test_a_joint_out_of_the_field_of_view_is_not_tracked(motion):
    T = POSES["left"].copy()
    T[:3, 3] += (1.2, 0.0, 0.0)  # so near that the feet are out of view
    frames = observe(
        motion,
        T,
        replace(CLEAN, wrongly_tracked=0.0),
        body_height=1.75,
        body_bias=np.zeros((len(JOINTS), 3, 4)),
        common_lags=np.zeros(len(JOINTS)),
        rng=np.random.default_rng(0),
    )
    assert np.mean(frames.tracking_state[:60, JOINT_INDEX["left_foot"]] == 2) < 0.05


@pytest.mark.parametrize(("own_lag", "alike"), [(0.0, True), (1.0, False)])
def test_sensors_are_late_alike_without_lags_of_their_own(own_lag, alike):
    truth = np.tile(np.linspace(0.0, 1.0, 60)[:, None, None], (1, len(JOINTS), 3))
    easy = np.zeros(truth.shape[:2])
    common = np.linspace(-0.5, 0.5, len(JOINTS))
    one, other = (
        tracked(
            truth,
            np.ones_like(truth),
            easy,
            easy,
            replace(CLEAN, lag=0.04, own_lag=own_lag),
            common,
            np.random.default_rng(seed),
        )
        for seed in (1, 2)
    )
    assert np.allclose(one, other) == alike
