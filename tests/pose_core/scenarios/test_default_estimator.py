"""The default estimator where people and sensors misbehave (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from synthetic_body import FRAME_NS, MODEL, extrinsics, kinematics, motion, skeleton_samples

from pose_core.estimators.parameters import PipelineParameters
from pose_core.filter.tuning import FilterTuning
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX, JOINTS, SIDES, TrackingState
from pose_core.kernels.published_state import Source

START_NS = 10**18
STEP = np.radians(4.0)  # [rad] beyond the motion itself, from one estimate to the next


def run(samples, is_live=False, **parameters):
    parameters = PipelineParameters(output_rate=0.0, **parameters)  # each frame's estimate
    pipeline = Pipeline(parameters, extrinsics(), is_live=is_live)
    return pipeline, fused(pipeline, samples)


def performance(duration_s, poses, move=(0.0, 0.0)):
    """Stand in the neutral pose for 3 s, then follow ``poses``: name to a function of time."""
    t = np.arange(round(duration_s * 30)) / 30.0
    dof = np.zeros((len(t), MODEL.size))
    dof[:, :3], dof[:, 5] = [2.0, 0.0, 0.9], np.pi
    dof[:, :2] += np.outer(t > 6.0, move)
    for name, pose in poses.items():
        dof[:, MODEL.dof_index[name]] = [pose(max(0.0, time - 3.0)) for time in t]
    return t, dof


def samples_of(dof, noise=0.004, seed=1):
    positions = kinematics().pose(dof).positions
    return skeleton_samples(positions, extrinsics(), np.random.default_rng(seed), noise)


def seconds(estimate):
    return (estimate.stamp_ns - START_NS) * 1e-9


def largest_step(estimates):
    angles = np.array([e.position[6:] for e in estimates])
    return float(np.max(np.abs(np.diff(angles, axis=0))))


def largest_joint_step(estimates):
    joints = np.array([e.joints for e in estimates])
    return float(np.max(np.linalg.norm(np.diff(joints, axis=0), axis=2)))


def error_deg(estimates, t, dof, name):
    index = MODEL.dof_index[name]
    truth = np.interp([seconds(e) for e in estimates], t, dof[:, index])
    return np.degrees(np.abs(np.array([e.position[index] for e in estimates]) - truth))


def raised(time):
    return np.radians(40.0) * min(1.0, time)


ARMS = {f"{side}_shoulder_flexion": raised for side in SIDES}


def test_every_frame_of_every_sensor_gives_an_estimate_at_once():
    _, dof = motion(5.0)
    pipeline = Pipeline(PipelineParameters(output_rate=0.0), extrinsics())
    told = [(s.stamp_ns, pipeline.add(s)) for s in samples_of(dof)]
    late = [(stamp, estimates) for stamp, estimates in told if stamp > START_NS + 3 * 10**9]
    assert all(estimates and estimates[-1].stamp_ns == stamp for stamp, estimates in late[::2])


def test_person_who_reappears_elsewhere_is_there_at_once_without_a_step_of_angles():
    _, dof = performance(10.0, ARMS, move=(0.6, 0.3))
    samples = [s for s in samples_of(dof) if not 4.5 < (s.stamp_ns - START_NS) * 1e-9 < 7.0]
    pipeline, estimates = run(samples)
    assert pipeline.counters["filter_restarts_gap"] == 1
    assert largest_step(estimates) < STEP
    parts = [e for e in estimates if seconds(e) < 6.0], [e for e in estimates if seconds(e) > 6.0]
    assert all(largest_joint_step(part) < 0.25 for part in parts)
    placed = parts[1][0].position[:2]
    np.testing.assert_allclose(placed, dof[-1, :2], atol=0.15)
    assert np.linalg.norm(placed - parts[0][-1].position[:2]) > 0.3
    np.testing.assert_allclose(estimates[-1].position[:2], dof[-1, :2], atol=0.03)


def test_sensor_dropout_and_return_cause_no_step():
    _, dof = performance(9.0, ARMS)
    samples = [
        s
        for s in samples_of(dof)
        if s.sensor == "left" or not 5.0 < (s.stamp_ns - START_NS) * 1e-9 < 7.0
    ]
    _, estimates = run(samples)
    # The turn of the straight arm about itself makes steps of 3.8 degrees with both sensors, too.
    assert largest_step([e for e in estimates if seconds(e) > 4.5]) < np.radians(4.7)


@pytest.mark.parametrize(("lowest", "highest"), [(0.0, 175.0), (-55.0, 20.0)])
def test_arms_overhead_and_behind_the_back_cause_no_step(lowest, highest):
    middle, size = np.radians((highest + lowest) / 2), np.radians((highest - lowest) / 2)

    def swing(time):
        return min(1.0, time) * (middle - size * np.cos(1.5 * time))

    t, dof = performance(11.0, {f"{side}_shoulder_flexion": swing for side in SIDES})
    _, estimates = run(samples_of(dof))
    of_motion = np.max(np.abs(np.diff(dof[:, 6:], axis=0)))
    assert largest_joint_step(estimates) < 0.10
    moved = [e for e in estimates if seconds(e) > 4.0]
    elbow = JOINT_INDEX["left_elbow"]
    truth = kinematics().pose(dof).positions[:, elbow]
    path = np.stack([np.interp([seconds(e) for e in moved], t, c) for c in truth.T], axis=1)
    error = np.linalg.norm([e.joints[elbow] for e in moved] - path, axis=1)
    assert np.median(error) < 0.05
    flexion = MODEL.dof_index["left_shoulder_flexion"]
    steps = np.abs(np.diff([e.position[flexion] for e in moved]))
    assert np.max(steps) < of_motion + 2 * STEP


def test_flexion_plane_of_a_straight_arm_is_found_within_a_few_frames():
    """A straight limb's turn about itself is unobservable: what was assumed must not hold it."""

    def bends(time):
        return np.radians(80.0) * np.clip(time - 2.0, 0.0, 1.0)

    def turned(time):
        return np.radians(-70.0) * np.clip(time, 0.0, 1.0)

    t, dof = performance(
        8.0, {"left_elbow_flexion": bends, "left_shoulder_rotation": turned, **ARMS}
    )
    _, estimates = run(samples_of(dof))
    settled = [e for e in estimates if seconds(e) > 6.8]
    assert np.median(error_deg(settled, t, dof, "left_elbow_flexion")) < 6.0
    assert np.median(error_deg(settled, t, dof, "left_shoulder_rotation")) < 15.0


def test_left_right_swaps_of_a_tracker_are_corrected():
    t, dof = motion(9.0)
    order = np.arange(15)
    for name in ("shoulder", "elbow", "hand", "hip", "knee", "foot"):
        left, right = (JOINT_INDEX[f"{side}_{name}"] for side in SIDES)
        order[[left, right]] = right, left
    wrong = [
        replace(s, positions=s.positions[order], tracking_state=s.tracking_state[order])
        if s.sensor == "right" and 6.0 < (s.stamp_ns - START_NS) * 1e-9 < 7.0
        else s
        for s in samples_of(dof)
    ]
    pipeline, estimates = run(wrong)
    assert pipeline.counters["sides_swapped"] > 30
    swapped = [e for e in estimates if 6.0 < seconds(e) < 7.0]
    assert np.median(error_deg(swapped, t, dof, "left_knee_flexion")) < 8.0


def test_a_state_that_faces_backwards_is_noticed_once_the_knees_bend():
    """Both trackers see the back at first and exchange the sides; then they do not."""

    def bend(time):
        return np.radians(60.0) * np.sin(np.pi * np.clip(time - 4.0, 0.0, 4.0) / 4.0)

    names = [f"{side}_{joint}_flexion" for side in SIDES for joint in ("hip", "knee")]
    _, dof = performance(12.0, dict.fromkeys(names, bend))
    exchanged = [
        JOINT_INDEX[name.replace("left", "X").replace("right", "left").replace("X", "right")]
        for name in JOINTS
    ]
    samples = [
        replace(s, positions=s.positions[exchanged]) if (s.stamp_ns - START_NS) * 1e-9 < 5.0 else s
        for s in samples_of(dof)
    ]
    pipeline, estimates = run(samples)
    assert pipeline.counters["filter_restarts_backwards"] == 1
    truth, last = kinematics().pose(dof).positions, estimates[-1]
    np.testing.assert_allclose(last.joints, truth[round(seconds(last) * 30)], atol=0.06)


def test_a_state_with_crossed_legs_is_noticed_as_both_trackers_contradict_it():
    _, dof = performance(8.0, ARMS)
    samples = samples_of(dof)
    pipeline, _ = run(samples[:240])
    state = pipeline._runner.estimator._filter.state
    names = pipeline.model.link_names
    below = [i for i, name in enumerate(names) if name.endswith(("pelvis", "thigh", "shank"))]
    state.pose.rotations[below] = np.diag([-1.0, -1.0, 1.0]) @ state.pose.rotations[below]
    estimates = fused(pipeline, samples[240:])
    assert pipeline.counters["filter_restarts_crossed"] == 1
    truth, last = kinematics().pose(dof).positions, estimates[-1]
    np.testing.assert_allclose(last.joints, truth[round(seconds(last) * 30)], atol=0.06)


def test_occluded_limbs_are_predicted_with_growing_deviation():
    _, dof = performance(8.0, ARMS)
    arm = [JOINT_INDEX["left_elbow"], JOINT_INDEX["left_hand"]]
    blind = []
    for sample in samples_of(dof):
        state, positions = sample.tracking_state.copy(), sample.positions.copy()
        state[arm], positions[arm] = TrackingState.NOT_TRACKED, np.nan
        hidden = replace(sample, positions=positions, tracking_state=state)
        blind.append(hidden if sample.stamp_ns > START_NS + 5 * 10**9 else sample)
    _, estimates = run(blind)
    elbow = MODEL.dof_index["left_elbow_flexion"]
    before = next(e for e in estimates if seconds(e) > 4.9)
    assert estimates[-1].source[elbow] == Source.PREDICTED
    assert estimates[-1].position_stddev[elbow] > 1.5 * before.position_stddev[elbow]


def test_noisier_sensors_enlarge_the_published_deviation():
    _, dof = motion(12.0)
    stddev = {}
    for noise in (0.005, 0.05):
        _, estimates = run(samples_of(dof, noise))
        stddev[noise] = np.median([e.position_stddev[6:] for e in estimates[-60:]])
    assert stddev[0.05] > 1.5 * stddev[0.005]


def as_delivered(samples, late_frames):
    """All samples in the order of arrival: the right tracker's come some frames late."""
    late_ns = {"left": 0, "right": late_frames * FRAME_NS}
    return sorted(samples, key=lambda s: (s.stamp_ns + late_ns[s.sensor], s.stamp_ns))


def test_a_late_frame_updates_the_filter_but_its_instant_is_not_published_again():
    _, dof = motion(6.0)
    pipeline, estimates = run(as_delivered(samples_of(dof), late_frames=2), is_live=True)
    stamps = [e.stamp_ns for e in estimates]
    assert np.all(np.diff(stamps) > 0)
    assert len(estimates) > 80
    assert pipeline.counters["frames_late_but_used"] > 80


@pytest.mark.parametrize("late_frames", [1, 2, 5])
def test_late_frames_give_the_pose_that_they_would_give_in_order(late_frames):
    _, dof = motion(6.0)
    samples = samples_of(dof)
    ends = []
    for late in (0, late_frames):
        pipeline = Pipeline(PipelineParameters(), extrinsics(), is_live=True)
        fused(pipeline, as_delivered(samples, late))
        ends.append(pipeline.predict(samples[-1].stamp_ns + FRAME_NS))
    in_order, late = ends
    assert in_order.stamp_ns == late.stamp_ns
    np.testing.assert_allclose(late.joints, in_order.joints, atol=5e-4)  # [m]
    np.testing.assert_allclose(late.position_stddev, in_order.position_stddev, rtol=0.02)


def test_frames_later_than_the_steps_that_are_kept_are_counted_and_left_out():
    _, dof = motion(6.0)
    pipeline, _ = run(as_delivered(samples_of(dof), late_frames=9), is_live=True)
    assert pipeline.counters["frames_late_but_used"] < 10  # at the start, of which nothing is kept
    assert pipeline.counters["frames_too_late"] > 80


def test_a_recording_is_interpolated_between_frames_without_a_hole():
    _, dof = performance(9.0, {"left_elbow_flexion": lambda s: 1.0 - np.cos(6.0 * s)})
    samples = [each for each in samples_of(dof, noise=0.001) if each.sensor == "left"]
    pipeline = Pipeline(PipelineParameters(output_rate=100.0), extrinsics())
    estimates = [e for e in fused(pipeline, samples) if 4.0 < seconds(e) < 8.9]
    assert set(np.diff([e.stamp_ns for e in estimates])) == {10_000_000}
    index, frames = MODEL.dof_index["left_elbow_flexion"], run(samples)[1]
    between = np.interp(
        [seconds(e) for e in estimates],
        [seconds(e) for e in frames],
        [e.position[index] for e in frames],
    )
    apart = np.degrees([e.position[index] for e in estimates] - between)
    assert np.abs(apart).max() < 3.0  # 6° if predicted from the frame before


def test_estimation_continues_after_a_recording_loops():
    _, dof = motion(4.0)
    samples = samples_of(dof)
    _, estimates = run(samples + samples)
    stamps = np.array([e.stamp_ns for e in estimates])
    assert np.sum(np.diff(stamps) < 0) == 1
    assert stamps[-1] == samples[-1].stamp_ns
    begin = int(np.argmax(np.diff(stamps) < 0)) + 1
    first, again = estimates[:begin], estimates[begin:]
    for one in again[:20]:  # as certain as the first time
        before = min(first, key=lambda e: abs(e.stamp_ns - one.stamp_ns))
        assert np.median(one.position_stddev / before.position_stddev) < 1.1


def test_the_smoother_publishes_the_same_instants_with_smaller_errors():
    t, dof = motion(10.0)
    samples = samples_of(dof, 0.02)
    _, live = run(samples)
    _, smooth = run(samples, estimator="smoothed")
    # Each begins when it knows the pose well enough.
    from_ns = max(live[0].stamp_ns, smooth[0].stamp_ns)
    live, smooth = ([e for e in each if e.stamp_ns >= from_ns] for each in (live, smooth))
    assert [e.stamp_ns for e in smooth] == [e.stamp_ns for e in live]
    names = ("left_knee_flexion", "right_hip_flexion", "left_shoulder_abduction")
    moving = [i for i, e in enumerate(live) if seconds(e) > 5.0]
    rms = {
        kind: np.sqrt(
            np.mean([error_deg([each[i] for i in moving], t, dof, n) ** 2 for n in names])
        )
        for kind, each in (("live", live), ("smooth", smooth))
    }
    assert rms["smooth"] < 0.95 * rms["live"]


@pytest.mark.parametrize("estimator", ["default", "smoothed"])
def test_axial_rotation_does_not_wind_up_when_arms_swing_overhead(estimator):
    """There flexion and rotation are one; what is smoothed is told of some seconds ago besides."""

    def swung(time):
        return np.radians(75.0) * (1.0 - np.cos(2.0 * np.pi * time / 3.0))

    t, dof = performance(16.0, {f"{side}_shoulder_abduction": swung for side in SIDES})
    _, estimates = run(samples_of(dof, 0.01), estimator=estimator)
    moving = [e for e in estimates if seconds(e) > 4.0]
    for side in SIDES:
        for degree in MODEL.links[f"{side}_upper_arm"].dof:
            index = MODEL.dof_index[degree.name]
            angle = np.array([e.position[index] for e in moving])
            # The straight arm's turn about itself winds once around for 2 % of the time.
            assert np.mean(np.degrees(np.abs(angle)) > 270.0) < 0.025
            assert np.degrees(np.abs(angle)).max() < 370.0
            hanging = [e for e in moving if swung(seconds(e) - 3.0) < np.radians(30.0)]
            assert np.median(error_deg(hanging, t, dof, degree.name)) < 15.0
            # On the way down, flexion and rotation may be on the other branch for a moment:
            # smoothed, with six noises, for 0 to 10 % of the time.
            assert np.mean(error_deg(hanging, t, dof, degree.name) > 90.0) < 0.12


def test_rates_decay_faster_with_a_single_camera():
    tuning = FilterTuning()
    assert tuning.for_cameras(2) is tuning
    one = tuning.for_cameras(1)
    assert one.motion.rate_memory == tuning.motion.one_camera_rate_memory
    assert one == one.for_cameras(1)
