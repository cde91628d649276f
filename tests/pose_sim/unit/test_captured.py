"""Captured clips, virtual trackers and IMUs on them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX, LIMB_ENDS, TrackingState
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_sim.captured.azure import MAP, NEAREST
from pose_sim.captured.clip import RATE
from pose_sim.captured.clips import bundled_clips, chain, read_clip, spun
from pose_sim.captured.imus import ImuModel, wear
from pose_sim.captured.motion import motion_of
from pose_sim.captured.residuals import resampled_residuals, residual_table
from pose_sim.captured.session import CapturedSpec, looking_at, make_captured_session
from pose_sim.captured.trackers import TRACKERS, TrackerModel, track

PATHS = bundled_clips()
CLIPS = [read_clip(path) for path in PATHS[:3]]
EXACT = TrackerModel(constant_offset=0.0, slow_offset=0.0, white=0.0, hidden_error=0.0, jitter=0.0)


@pytest.fixture(scope="module")
def clip():
    return chain(CLIPS, 5.0)


@pytest.fixture
def place():
    return looking_at(np.array([4.0, 1.0, 1.2]), np.array([0.0, 0.0, 0.9]))


def test_some_clips_come_with_the_package():
    assert len(PATHS) >= 6


def test_chained_clips_make_no_jump():
    whole = chain(CLIPS, 30.0)
    speed = RATE * np.linalg.norm(np.diff(whole.positions, axis=0), axis=2)
    assert speed.max() < 12.0  # [m/s]
    turns = [each[1:] * each[:-1].inv() for each in whole.rotations.values()]
    assert max(turn.magnitude().max() for turn in turns) < np.radians(40.0)


def test_limbs_keep_their_lengths_between_two_clips():
    whole = chain(CLIPS, 30.0)
    for start, end in LIMB_ENDS.values():
        bones = whole.positions[:, JOINT_INDEX[end]] - whole.positions[:, JOINT_INDEX[start]]
        lengths = np.linalg.norm(bones, axis=1)
        np.testing.assert_allclose(lengths, np.median(lengths), rtol=0.02)


def test_a_chain_has_the_requested_duration():
    assert len(chain(CLIPS, 2.0)) == round(2.0 * RATE)


def test_who_spins_keeps_the_lengths_of_the_bones():
    whole = chain(CLIPS, 10.0)
    turned = spun(whole, np.random.default_rng(1))
    bone = np.linalg.norm(whole.positions[:, 1] - whole.positions[:, 2], axis=1)
    after = np.linalg.norm(turned.positions[:, 1] - turned.positions[:, 2], axis=1)
    np.testing.assert_allclose(after, bone, atol=1e-9)


def test_an_exact_tracker_measures_the_joints_a_delay_ago():
    clip = chain(CLIPS, 5.0)
    T_map_camera = looking_at(np.array([4.0, 1.0, 1.2]), np.array([0.0, 0.0, 0.9]))
    model = TrackerModel(**{**vars(EXACT), "delay": 0.1})
    frames = track(clip.positions, T_map_camera, model, np.random.default_rng(2))
    seen = frames.positions @ T_map_camera[:3, :3].T + T_map_camera[:3, 3]
    row = len(seen) // 2
    instant = (frames.stamps_s[row] - 0.1) * RATE
    before = clip.positions[int(instant)]
    after = clip.positions[int(instant) + 1]
    expected = before + (instant - int(instant)) * (after - before)
    np.testing.assert_allclose(seen[row], expected, atol=1e-6)


def test_a_tracker_without_confidence_calls_every_joint_tracked():
    clip = chain(CLIPS, 5.0)
    T = looking_at(np.array([3.0, 0.0, 1.2]), np.array([0.0, 0.0, 0.9]))
    frames = track(clip.positions, T, TRACKERS["unconfident"], np.random.default_rng(3))
    assert np.all(frames.tracking_state == TrackingState.TRACKED)


def test_azures_32_joints_come_back_as_the_15(clip, place):
    model = TrackerModel(**{**vars(EXACT), "has_32_joints": True})
    frames = track(clip.positions, place, model, np.random.default_rng(3))
    true = track(clip.positions, place, EXACT, np.random.default_rng(3))
    apart = np.linalg.norm(frames.positions - true.positions, axis=2)
    # The joint map takes the neck between the collar bones.
    assert np.median(apart, axis=0).max() < 0.03
    assert np.median(apart) < 1e-6


def test_an_uneven_tracker_leaves_frames_out(clip, place):
    frames = track(clip.positions, place, TRACKERS["uneven"], np.random.default_rng(3))
    gaps = np.diff(frames.stamps_s)
    assert 15.0 < len(gaps) / gaps.sum() < 29.0
    assert gaps.max() > 0.06


def test_in_an_uneven_session_every_tracker_leaves_frames_out():
    spec = CapturedSpec(
        name="x", clips=tuple(PATHS[:1]), trackers=("calm", "azure"), spins=False, seed=5,
        duration_s=4.0, uneven=True,
    )  # fmt: skip
    for frames in make_captured_session(spec).frames.values():
        assert np.diff(frames.stamps_s).max() > 0.06


def test_real_residuals_keep_their_size_and_are_correlated_in_time(clip):
    errors = resampled_residuals(clip.positions, RATE, np.random.default_rng(4))
    table = residual_table()
    size = np.linalg.norm(errors, axis=2).mean()
    assert size == pytest.approx(np.linalg.norm(table.residuals, axis=2).mean(), rel=0.5)
    errors = errors - errors.mean(axis=0)
    alike = np.mean(errors[6:] * errors[:-6]) / np.mean(errors**2)  # 0.1 s apart
    assert alike > 0.8


def test_delays_and_a_clock_that_is_ahead_are_in_the_stamps():
    spec = CapturedSpec(
        name="x", clips=tuple(PATHS[:1]), trackers=("calm", "calm"), spins=False, seed=5,
        duration_s=4.0, delays_s=(0.0, 0.08), clock_offset_s=0.2,
    )  # fmt: skip
    assert spec.mean_delay_s == pytest.approx(0.04)
    session = make_captured_session(spec)
    first = {sample.sensor: sample.stamp_ns for sample in session.samples(imus=False)[::-1]}
    ahead_s = (first["right"] - first["left"]) * 1e-9
    stamps = session.frames
    apart_s = stamps["right"].stamps_s[0] - stamps["left"].stamps_s[0]
    assert ahead_s == pytest.approx(apart_s + 0.2, abs=1e-6)
    arrivals = [arrival_ns for arrival_ns, _ in session.arrivals(imus=False)]
    assert arrivals == sorted(arrivals)
    assert arrivals[-1] < max(sample.stamp_ns for sample in session.samples(imus=False))


def test_captured_motion_goes_forth_and_back_until_the_time_is_filled(clip):
    motion = motion_of(clip, 12.0, place=(1.0, 2.0), facing=0.3)
    assert motion.times[-1] == pytest.approx(12.0)
    row = round(clip_s(clip) * 200.0)
    before, after = motion.pose.joints[row - 100], motion.pose.joints[row + 100]
    np.testing.assert_allclose(before, after, atol=0.02)  # 1.7 ms apart
    middle = motion.pose.joints[..., :2].reshape(-1, 2).mean(axis=0)
    np.testing.assert_allclose(middle, [1.0, 2.0], atol=0.01)


def clip_s(clip):
    return (len(clip) - 1) / RATE


def test_an_exact_imu_turns_with_its_segment():
    clip = chain(CLIPS, 5.0)
    model = ImuModel(field=0.0, heading_walk=0.0, tilt=0.0, soft_tissue=0.0, gyro_bias=0.0)
    stream = wear(clip, model, np.random.default_rng(4))[0]
    index = np.flatnonzero(stream.stamps_s > 2.0)[0]
    frames = np.round(stream.stamps_s[[0, index]] * RATE).astype(int)
    sensor = Rotation.from_quat(stream.orientation[[0, index]])
    segment = clip.rotations[stream.segment][frames]
    felt = (sensor[1] * sensor[0].inv()).magnitude()
    true = (segment[1] * segment[0].inv()).magnitude()
    assert felt == pytest.approx(true, abs=np.radians(3.0))


def test_a_disturbance_makes_headings_swing_about_the_vertical():
    clip, exact = chain(CLIPS, 60.0), dict.fromkeys(("heading_walk", "tilt", "soft_tissue"), 0.0)
    even, uneven = (
        wear(clip, ImuModel(**exact, disturbance=size), np.random.default_rng(4))[0]
        for size in (0.0, 0.2)
    )
    swing = Rotation.from_quat(uneven.orientation) * Rotation.from_quat(even.orientation).inv()
    about = swing.as_rotvec()
    assert np.abs(about[:, :2]).max() < 1e-6
    assert about[:, 2].std() == pytest.approx(0.2, rel=0.5)


def test_without_a_magnetometer_headings_are_unknown_and_drift():
    clip, exact = chain(CLIPS, 60.0), dict.fromkeys(("heading_walk", "tilt", "soft_tissue"), 0.0)
    models = (ImuModel(**exact), ImuModel(**exact, has_magnetometer=False))
    headings = []
    for seed in range(6):
        north, drifting = (
            Rotation.from_quat(wear(clip, model, np.random.default_rng(seed))[0].orientation)
            for model in models
        )
        headings.append((drifting * north.inv()).as_rotvec()[:, 2])
    assert np.std([heading[0] for heading in headings]) > 0.5
    drifts = [np.ptp(np.unwrap(heading)) for heading in headings]
    assert np.mean(drifts) == pytest.approx(0.8 * 60.0 * models[1].drift, rel=0.6)
    assert models[1].orientation_stddev[2] > 1.0 > models[0].orientation_stddev[2]


def test_the_same_spec_gives_the_same_session():
    spec = CapturedSpec(
        name="x", clips=tuple(PATHS[:2]), trackers=("mixed", "late"), spins=True, seed=5,
        duration_s=6.0,
    )  # fmt: skip
    first, second = make_captured_session(spec), make_captured_session(spec)
    np.testing.assert_array_equal(first.frames["left"].positions, second.frames["left"].positions)
    np.testing.assert_array_equal(first.imus[0].orientation, second.imus[0].orientation)


def test_a_file_that_is_not_a_clip_is_refused(tmp_path):
    (tmp_path / "bad.npz").write_text("nothing")
    with pytest.raises(InputError, match="not a clip of captured motion"):
        read_clip(tmp_path / "bad.npz")


def test_azures_joints_err_as_the_joints_that_they_are_nearest_to():
    names = shipped_joint_map(MAP).joints
    for name, own in (("PELVIS", "left_hip"), ("KNEE_RIGHT", "right_knee"), ("NOSE", "head")):
        assert NEAREST[names.index(name)] == JOINT_INDEX[own]
