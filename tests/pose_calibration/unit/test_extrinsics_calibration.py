"""Extrinsics from several sensors' skeletons of one person."""

import numpy as np
import pytest
from walking_person import (
    LEFT,
    POSES,
    RIGHT,
    SWAPPED,
    angle_deg,
    frames,
    sensor_pose,
    with_positions,
)

from pose_calibration.extrinsics.extrinsics_calibration import ExtrinsicsCalibrator
from pose_calibration.extrinsics.frame_memory import MAX_KEPT_FRAMES
from pose_calibration.extrinsics.joint_refinement import body_axes
from pose_calibration.extrinsics.parameters import CalibrationParameters
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_core.errors import ParameterError, PoseError
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_core.session.extrinsics import LITTLE_MOTION, extrinsics_from_map
from pose_core.streams.time_alignment import AlignedFrame
from pose_core.transforms import inverse, transformed

TRUE = inverse(LEFT) @ RIGHT
PERSON = np.array([[0.0, 0.0, 2.5]])  # [m] where the person is, as the right sensor sees it


def solve(some_frames, sensors=("left", "right"), **options):
    calibrator = ExtrinsicsCalibrator(sensors, **options)
    for frame in some_frames:
        calibrator.add(frame)
    return calibrator.solve()


def error_m(T):
    return float(np.linalg.norm(transformed(T, PERSON) - transformed(TRUE, PERSON)))


def test_a_person_who_walks_about_gives_the_extrinsics():
    extrinsics = solve(frames(noise=0.02))
    assert extrinsics.sensors == ("left", "right")
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.2
    assert error_m(extrinsics.T_reference_sensor["right"]) < 0.005
    np.testing.assert_array_equal(extrinsics.T_reference_sensor["left"], np.eye(4))


def test_the_residuals_contain_the_agreement_before_and_after():
    pair = solve(frames(noise=0.02)).residuals["right"]
    assert pair.raw_median > 0.5
    assert pair.inlier_rms == pytest.approx(0.02 * np.sqrt(6.0), rel=0.1)
    assert min(pair.inlier_share.values()) > 0.95
    assert pair.frames == 300


def test_trackers_of_the_same_scale_do_not_differ_in_scale():
    pair = solve(frames(noise=0.02)).residuals["right"]
    assert not pair.scale_differs
    assert pair.position_noise < 0.02


@pytest.mark.parametrize("sensor", ["left", "right"])
def test_two_seconds_of_random_joints_are_no_difference_of_scale(sensor):
    rng = np.random.default_rng(1)

    def leaping(index, frame):
        joints = rng.uniform(-5.0, 5.0, (15, 3))
        return with_positions(frame, sensor, joints) if 100 < index < 160 else frame

    some = [leaping(index, frame) for index, frame in enumerate(frames(noise=0.02))]
    pair = solve(some).residuals["right"]
    assert not pair.scale_differs
    assert pair.scale == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("scale", [0.95, 1.04])
def test_a_tracker_with_a_wrong_scale_makes_the_position_uncertain(scale):
    def scaled(frame):
        return with_positions(frame, "right", scale * frame.samples["right"].positions)

    extrinsics = solve([scaled(frame) for frame in frames(noise=0.02)])
    pair = extrinsics.residuals["right"]
    assert pair.scale_differs
    assert pair.scale == pytest.approx(scale, abs=0.005)
    T = extrinsics.T_reference_sensor["right"]
    error = np.linalg.norm(T[:3, 3] - TRUE[:3, 3])
    assert error > 0.05
    assert error < 2.0 * pair.position_stddev


def test_the_sensors_places_in_map_follow():
    extrinsics = solve(frames(noise=0.01))
    T_left, T_right = (extrinsics.T_map_sensor(name) for name in ("left", "right"))
    np.testing.assert_allclose(inverse(T_left) @ T_right, extrinsics.T_reference_sensor["right"])
    assert T_left[2, 3] == pytest.approx(LEFT[2, 3], abs=0.03)


def test_exchanging_the_sensors_inverts_the_transform():
    some = frames(noise=0.01)
    forth = solve(some).T_reference_sensor["right"]
    back = solve(some, sensors=("right", "left")).T_reference_sensor["left"]
    np.testing.assert_allclose(back, inverse(forth), atol=2e-3)


def test_a_third_sensor_is_calibrated_against_the_first():
    poses = {**POSES, "back": sensor_pose(5.0, 0.5, 1.4, 170.0, tilt_deg=10.0)}
    extrinsics = solve(frames(poses=poses), sensors=tuple(poses))
    assert set(extrinsics.residuals) == {"right", "back"}
    T = extrinsics.T_reference_sensor["back"]
    assert angle_deg(T, inverse(LEFT) @ poses["back"]) < 0.2


def test_a_single_sensor_gets_its_place_above_the_floor_alone():
    extrinsics = solve(frames(), sensors=("left",))
    assert extrinsics.residuals == {}
    assert extrinsics.T_map_sensor("left")[2, 3] == pytest.approx(LEFT[2, 3], abs=0.03)


def test_frames_with_left_and_right_swapped_are_put_right():
    some = frames(noise=0.01)
    for index in range(0, len(some), 3):
        swapped = some[index].samples["right"].positions[SWAPPED]
        some[index] = with_positions(some[index], "right", swapped)
    extrinsics = solve(some)
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.3
    assert extrinsics.residuals["right"].inlier_share["left_shoulder"] > 0.95
    assert extrinsics.residuals["right"].inlier_share["neck"] > 0.95


def test_a_skeleton_turned_by_180_degrees_in_one_view_is_an_outlier():
    some = frames(noise=0.01)
    for index in range(0, len(some), 4):
        positions = some[index].samples["right"].positions
        axis = positions[JOINT_INDEX["torso"]]
        turned = positions.copy()
        turned[:, [0, 2]] = 2.0 * axis[[0, 2]] - positions[:, [0, 2]]
        some[index] = with_positions(some[index], "right", turned)
    assert angle_deg(solve(some).T_reference_sensor["right"], TRUE) < 0.3


def test_a_joint_that_is_always_wrong_is_an_outlier():
    some = frames(noise=0.01)
    hand = JOINT_INDEX["left_hand"]
    for index, frame in enumerate(some):
        positions = frame.samples["right"].positions.copy()
        positions[hand] += [0.4, 0.3, 0.0]
        some[index] = with_positions(frame, "right", positions)
    extrinsics = solve(some)
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.2
    assert extrinsics.residuals["right"].inlier_share["left_hand"] == 0.0


def test_inferred_and_missing_joints_are_not_used():
    some = frames(noise=0.01)
    foot, hand = JOINT_INDEX["left_foot"], JOINT_INDEX["left_hand"]
    for index, frame in enumerate(some):
        positions = frame.samples["right"].positions.copy()
        state = frame.samples["right"].tracking_state.copy()
        positions[foot], state[foot] = np.nan, TrackingState.NOT_TRACKED
        positions[hand], state[hand] = 99.0, TrackingState.INFERRED
        some[index] = with_positions(frame, "right", positions, state)
    extrinsics = solve(some)
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.2
    assert {"left_foot", "left_hand"}.isdisjoint(extrinsics.residuals["right"].inlier_share)


def test_a_nan_that_claims_to_be_tracked_does_no_harm():
    some = frames(noise=0.01)
    positions = some[5].samples["left"].positions.copy()
    positions[3] = np.nan
    some[5] = with_positions(some[5], "left", positions)
    assert angle_deg(solve(some).T_reference_sensor["right"], TRUE) < 0.2


def test_a_person_who_stands_still_is_refused():
    still = frames(walks=False, moves=False, noise=0.003)
    strict = CalibrationParameters(rotation_stddev=LITTLE_MOTION)
    with pytest.raises(CalibrationError, match=r"too little motion .* raise the arms"):
        solve(still, parameters=strict)


def test_a_recording_of_little_motion_is_used_and_says_so():
    assert solve(frames(walks=False, moves=False, noise=0.003)).residuals["right"].needs_motion
    assert not solve(frames(noise=0.003)).residuals["right"].needs_motion


def test_moving_the_arms_on_one_spot_is_enough():
    extrinsics = solve(frames(walks=False, noise=0.01))
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.5


def test_joints_on_a_line_are_refused():
    some = frames(duration_s=10.0, walks=False, moves=False, noise=0.001)
    line = [JOINT_INDEX[name] for name in ("head", "neck", "torso")]
    state = np.zeros(15, np.uint8)
    state[line] = TrackingState.TRACKED
    some = [with_positions(f, "left", f.samples["left"].positions, state) for f in some]
    with pytest.raises(CalibrationError, match="nearly collinear"):
        solve(some)


def test_too_few_frames_are_refused_with_their_number():
    with pytest.raises(CalibrationError, match=r"found 30 frames .* expected 60"):
        solve(frames()[:30])


def test_sensors_that_never_see_the_person_together_are_refused():
    lonely = [
        AlignedFrame(stamp_ns=f.stamp_ns, samples={name: f.samples[name]})
        for f, name in zip(frames(), ["left", "right"] * 150, strict=True)
    ]
    with pytest.raises(CalibrationError, match=r"found 0 frames .* 'left' and 'right'"):
        solve(lonely)


def test_views_of_different_persons_are_refused():
    some = frames()
    mixed = [
        with_positions(f, "right", other.samples["right"].positions)
        for f, other in zip(some, some[::-1], strict=True)
    ]
    with pytest.raises(CalibrationError, match="disagree even after calibration"):
        solve(mixed)


def test_no_frames_are_refused():
    with pytest.raises(CalibrationError, match="found 0 frames"):
        ExtrinsicsCalibrator(("left", "right")).solve()


def test_the_refusal_is_an_error_that_tools_print_as_one_line():
    assert issubclass(CalibrationError, PoseError)


def test_a_sensor_named_twice_is_refused():
    with pytest.raises(ParameterError, match="different names"):
        ExtrinsicsCalibrator(("left", "left"))


def test_limits_are_the_user_s():
    parameters = CalibrationParameters(minimum_frames=10)
    assert solve(frames()[:60], parameters=parameters).residuals["right"].frames == 60


def test_memory_is_bounded_and_keeps_the_short_walk_among_long_standing():
    calibrator = ExtrinsicsCalibrator(("left", "right"))
    walk = frames(duration_s=10.0)
    stand = frames(duration_s=1.0, walks=False, moves=False)[0]
    for frame in walk:
        calibrator.add(frame)
    for index in range(3 * MAX_KEPT_FRAMES):
        stamp_ns = walk[-1].stamp_ns + (index + 1) * 100_000_000
        calibrator.add(AlignedFrame(stamp_ns=stamp_ns, samples=stand.samples))
    kept = np.stack([frame.positions for frame in calibrator.memory.frames()])
    assert len(kept) <= MAX_KEPT_FRAMES
    standing = np.isclose(kept[:, 0], stand.samples["left"].positions).all(axis=(1, 2))
    assert (~standing).sum() > 0.9 * len(walk)
    assert angle_deg(calibrator.solve().T_reference_sensor["right"], TRUE) < 1.0


def test_common_view_is_counted_without_pauses():
    calibrator = ExtrinsicsCalibrator(("left", "right"))
    some = frames(duration_s=2.0)
    for frame in some:
        calibrator.add(frame)
    for frame in some:
        calibrator.add(
            AlignedFrame(stamp_ns=frame.stamp_ns + 60_000_000_000, samples=frame.samples)
        )
    assert calibrator.memory.observed_s == pytest.approx(2 * (len(some) - 1) / 15.0)


def test_places_in_map_become_extrinsics_again():
    extrinsics = extrinsics_from_map(POSES)
    assert extrinsics.reference == "left"
    np.testing.assert_allclose(extrinsics.T_reference_sensor["right"], TRUE)
    np.testing.assert_allclose(extrinsics.T_map_sensor("right"), RIGHT)


def test_a_sensor_with_swapped_sides_is_calibrated_too():
    some = [
        with_positions(f, "right", f.samples["right"].positions[SWAPPED])
        for f in frames(noise=0.01)
    ]
    assert angle_deg(solve(some).T_reference_sensor["right"], TRUE) < 0.3


def test_offsets_that_depend_on_the_view_are_found_and_do_not_turn_the_sensor():
    rng = np.random.default_rng(3)
    offsets = rng.normal(0.0, 0.012, (2, 15, 3))  # in the body's axes
    some = frames(duration_s=30.0, noise=0.005)
    for index, frame in enumerate(some):
        for sensor, T, offset in zip(POSES, POSES.values(), offsets, strict=True):
            axes = body_axes(transformed(T, frame.samples[sensor].positions)[None])[0]
            moved = frame.samples[sensor].positions + offset @ axes.T @ T[:3, :3]
            frame = with_positions(frame, sensor, moved)
        some[index] = frame
    extrinsics = solve(some)
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.4
    off = extrinsics.T_reference_sensor["right"][:3, 3] - TRUE[:3, 3]
    assert np.linalg.norm(off) < 0.02
    found = extrinsics.view_offsets["right"] - extrinsics.view_offsets["left"]
    true = offsets[1] - offsets[0]
    assert np.corrcoef((found - found.mean(0)).ravel(), (true - true.mean(0)).ravel())[0, 1] > 0.8


def test_sensors_are_linked_through_one_that_shares_views_with_both():
    poses = {**POSES, "back": sensor_pose(5.0, 0.5, 1.1, 170.0)}
    some = frames(duration_s=30.0, poses=poses)
    for index, frame in enumerate(some):
        left_out = "back" if index % 2 else "left"  # never seen together
        kept = {name: one for name, one in frame.samples.items() if name != left_out}
        some[index] = AlignedFrame(stamp_ns=frame.stamp_ns, samples=kept)
    extrinsics = solve(some, sensors=tuple(poses))
    assert extrinsics.residuals["back"].partner == "right"
    true = inverse(LEFT) @ poses["back"]
    assert angle_deg(extrinsics.T_reference_sensor["back"], true) < 0.4


def test_eight_sensors_are_solved_together():
    poses = {
        f"s{i}": sensor_pose(
            2.5 - 2.5 * np.cos(a), -2.5 * np.sin(a), 1.2, float(np.degrees(a)), tilt_deg=5.0
        )
        for i, a in enumerate(np.linspace(-1.5, 1.5, 8))
    }
    extrinsics = solve(frames(duration_s=20.0, poses=poses), sensors=tuple(poses))
    for name in poses:
        true = inverse(poses["s0"]) @ poses[name]
        assert angle_deg(extrinsics.T_reference_sensor[name], true) < 0.3
        assert np.linalg.norm(extrinsics.T_reference_sensor[name][:3, 3] - true[:3, 3]) < 0.015


def test_a_sensor_without_common_view_may_be_left_out_for_the_time_being():
    poses = {**POSES, "late": sensor_pose(5.0, 0.5, 1.1, 170.0)}
    calibrator = ExtrinsicsCalibrator(tuple(poses))
    for frame in frames():
        calibrator.add(frame)
    with pytest.raises(CalibrationError, match=r"found 0 frames .* 'late'"):
        calibrator.solve()
    assert calibrator.solve(allow_missing=True).sensors == ("left", "right")
