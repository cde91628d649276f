"""What is published has no steps, stays within limits, and its rate is its derivative."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, SHAPE, kinematics

from pose_core.body.kinematics import model_arrays
from pose_core.fusion.output_grid import OutputGrid
from pose_core.kernels.output import blend_joints, blend_root
from pose_core.kernels.output_blending import (
    BLEND_OF_PREDICTION,
    BLEND_S,
    MAX_TRAVEL,
    TRAVEL_AFTER_GAP,
    advance_clock,
    advance_skeleton_clock,
    blend_angle,
    make_blending,
)
from pose_core.kernels.published_state import PublishedState, make_dof_estimate

MS = 1_000_000
LIMITS = np.radians([-110.0, 110.0])
PERIOD_S = 0.01


def estimate(value, rate=0.0, stddev_deg=2.0):
    dof = make_dof_estimate(1)
    dof.position[0], dof.velocity[0] = value, rate
    dof.variance[0] = np.radians(stddev_deg) ** 2
    return dof


def publish(targets, rates, stddev_deg=2.0):
    """Angles, rates, whether known, added variances of a filter's angles at 100 Hz [rad]."""
    blending = make_blending(1)
    blending.slow_s[0] = 0.0  # the start is over
    rows = []
    for k, (value, rate) in enumerate(zip(targets, rates, strict=True)):
        dof = estimate(value, rate, stddev_deg)
        is_known = blend_angle(blending, 0, PERIOD_S if k else 0.0, dof, LIMITS)
        rows.append((blending.position[0], blending.velocity[0], is_known, dof.blended[0]))
    position, velocity, known, variance = (np.array(each) for each in zip(*rows, strict=True))
    return position, velocity, known, variance


def unexplained(position, velocity):
    return np.abs(np.diff(position) - 0.5 * (velocity[1:] + velocity[:-1]) * PERIOD_S)


def test_the_first_published_pose_equals_the_filters():
    position, velocity, known, _ = publish([0.3], [1.5])
    assert (position[0], velocity[0], known[0]) == (0.3, 1.5, True)


@pytest.mark.parametrize("jump_deg", [3.0, 30.0, 85.0, -180.0])
def test_a_step_of_the_filter_is_blended_out_and_enlarges_the_deviation(jump_deg):
    jump = np.radians(jump_deg)
    start = -0.5 * jump
    targets = np.where(np.arange(150) < 50, start, start + jump)
    position, velocity, _, variance = publish(targets, np.zeros(150))
    assert np.degrees(unexplained(position, velocity).max()) < 3.0
    assert np.abs(np.diff(position)).max() <= MAX_TRAVEL * PERIOD_S
    np.testing.assert_allclose(position[-1], targets[-1], atol=1e-6)
    apart = np.abs(position - targets)
    assert (np.sqrt(variance[51:]) >= apart[51:] - 1e-9).all()


def test_the_published_pose_has_no_steps_at_the_start():
    saw = np.where(np.arange(400) // 2 % 2, np.radians(1.5), np.radians(-1.5))
    blending, position = make_blending(1), []
    for k, value in enumerate(saw):
        dt_s = advance_clock(blending, 10**18 + 10 * MS * k)
        blend_angle(blending, 0, dt_s, estimate(value), LIMITS)
        blending.stamp_ns[0] = 10**18 + 10 * MS * k
        position.append(blending.position[0])
    second = np.abs(np.diff(position, n=2))
    assert second[5:150].max() < 0.5 * second[250:].max()


@pytest.mark.parametrize("silent_s", [2.0, 8.0])
def test_after_a_gap_the_published_pose_converges_without_a_step(silent_s):
    """Late messages too, 60 ms apart instead of 10."""
    gaps_s = np.concatenate([np.full(10, 0.01), [silent_s], np.full(20, 0.06), np.full(200, 0.01)])
    stamps_ns = 10**18 + np.round(1e9 * np.cumsum(gaps_s)).astype(np.int64)
    blending, position = make_blending(1), []
    for k, stamp_ns in enumerate(stamps_ns.tolist()):
        dof = estimate(0.0 if k < 10 else np.radians(80.0))
        blend_angle(blending, 0, advance_clock(blending, stamp_ns), dof, LIMITS)
        blending.stamp_ns[0] = stamp_ns
        position.append(blending.position[0])
    steps = np.abs(np.diff(position))
    assert (steps <= 1.01 * TRAVEL_AFTER_GAP * np.minimum(gaps_s[1:], 0.06)).all()
    assert np.degrees(steps.max()) < 10.0
    reached_s = (stamps_ns[np.argmax(np.degrees(position) > 79.0)] - stamps_ns[10]) * 1e-9
    assert reached_s < 1.5


def test_blending_adds_no_lag_to_a_smooth_filter():
    t = np.arange(300) * PERIOD_S
    true, rate = 0.8 * np.sin(4.0 * t), 3.2 * np.cos(4.0 * t)
    position, velocity, known, _ = publish(true, rate)
    assert np.degrees(np.abs(position - true).max()) < 0.1
    assert np.degrees(np.abs(velocity - rate).max()) < 4.0
    assert known.all()


def published_root(targets, velocities, blend_s):
    """Positions [m] of a root, (n, 3), at 100 Hz, by the filter's and their velocities."""
    blending, rows = make_blending(MODEL.size), []
    blending.slow_s[0] = 0.0  # the start is over
    for k, (target, velocity) in enumerate(zip(targets, velocities, strict=True)):
        dof = make_dof_estimate(MODEL.size)
        dof.position[:3], dof.velocity[:3] = target, velocity
        blend_root(PERIOD_S if k else 0.0, blend_s, np.eye(3), blending, dof)
        rows.append(blending.position[:3].copy())
    return np.array(rows)


@pytest.mark.parametrize("frames", [1, 5])
@pytest.mark.parametrize(("moved_m", "is_placed"), [(3.0, True), (0.1, False)])
@pytest.mark.parametrize("has_imus", [False, True])
def test_who_is_seen_again_elsewhere_is_placed_there(moved_m, is_placed, has_imus, frames):
    """For two seconds there is no output, or one by IMUs alone, whose deviation grows.

    Then the filter needs some frames until it has moved.
    """
    blending, rows = make_blending(MODEL.size), []
    for k in range(-100, 210):
        is_away, is_back = 0 <= k < 200, k >= 200
        if is_away and not has_imus:
            continue
        dof = make_dof_estimate(MODEL.size)
        dof.position[0] = moved_m * min(1.0, (k - 199) / frames) if is_back else 0.0
        dof.information[0] = 0.0 if is_away else 1e3
        stamp_ns = 10**18 + 10 * MS * k
        dt_s = advance_clock(blending, stamp_ns)
        blend_root(advance_skeleton_clock(blending, dof, dt_s), BLEND_S, np.eye(3), blending, dof)
        blending.stamp_ns[0] = stamp_ns
        rows.append((is_back, blending.position[0], blending.unseen_s[0]))
    is_back, x, unseen_s = np.array(rows).T
    assert (x[is_back == 0.0] == 0.0).all()
    back = x[is_back == 1.0]
    if is_placed:
        assert (back[frames - 1 :] == moved_m).all()
    else:
        assert 0.0 < back[0] < 0.5 * moved_m
        assert back[-1] == pytest.approx(moved_m, abs=0.01)
    assert unseen_s[-1] == 0.0
    if has_imus:
        assert unseen_s.max() == pytest.approx(2.0, abs=0.02)


def test_a_root_that_is_predicted_far_ahead_shakes_less_and_keeps_up_with_a_walk():
    rng, ahead_s = np.random.default_rng(4), 0.12
    t = np.arange(500) * PERIOD_S
    true = np.outer(t, [1.2, 0.0, 0.0])
    errors = np.repeat(rng.normal(0.0, 0.15, (100, 3)), 5, axis=0)  # [m/s], of one frame each
    velocities = np.array([1.2, 0.0, 0.0]) + errors
    targets = true + ahead_s * errors
    at_once = published_root(targets, velocities, BLEND_S)
    steadier = published_root(targets, velocities, BLEND_OF_PREDICTION * ahead_s)
    shake = [np.std(np.diff(each, n=2, axis=0)) for each in (at_once, steadier)]
    assert shake[1] < 0.3 * shake[0]
    assert np.abs(np.mean(steadier - true, axis=0)).max() < 0.005
    assert np.std(steadier - true) < np.std(at_once - true)


def published_joints(poses, rates, jumps=0.0):
    """Joints as published at 100 Hz, (n, 15, 3), of a person with a root at rest.

    Args:
        poses: The filter's poses.
        rates: Angular velocities of its links, (n, links, 3) [rad/s].
        jumps: Errors of its joints, (n, 15, 3) [m].
    """
    model, blending = model_arrays(MODEL, SHAPE.offsets), make_blending(MODEL.size)
    jumps, zero = np.broadcast_to(jumps, (len(poses.positions), 15, 3)), np.zeros(3)
    found = np.empty_like(poses.positions)
    for k, joints in enumerate(poses.positions):
        links = len(poses.rotations[k])
        state = PublishedState(
            zero,
            zero,
            poses.rotations[k],
            rates[k],
            joints + jumps[k],
            zero,
            np.zeros((links, 3, 3)),
            np.zeros((2, links, 3, 3)),
            np.ones(1),
            np.zeros(1),
        )
        blending.R_map_root[:] = poses.rotations[k, 0]
        blend_joints(model, PERIOD_S if k else 0.0, state, blending, found[k])
    return found


def test_a_step_of_a_joint_is_blended_out():
    poses = kinematics().pose(np.zeros((100, MODEL.size)))
    jumps = np.zeros((100, 15, 3))
    jumps[50:, -1] = [0.3, 0.0, 0.2]
    found = published_joints(poses, np.zeros((*poses.rotations.shape[:2], 3)), jumps)
    steps = np.linalg.norm(np.diff(found, axis=0), axis=2)
    assert steps[:, -1].max() < 0.1
    assert steps[:, :-1].max() < 1e-9
    np.testing.assert_allclose(found[-1], poses.positions[-1] + jumps[-1], atol=1e-6)


def test_a_hand_whose_rate_is_not_known_yet_is_followed_from_the_start_on():
    poses = kinematics().pose(np.zeros((100, MODEL.size)))
    moved = np.zeros((100, 15, 3))
    moved[:, -1, 0] = 4.0 * PERIOD_S * np.arange(100)
    found = published_joints(poses, np.zeros((*poses.rotations.shape[:2], 3)), moved)
    assert np.abs(found - poses.positions - moved).max() < 0.05


def test_blending_adds_no_lag_to_moving_joints():
    t = np.arange(200) * PERIOD_S
    dof = np.zeros((200, MODEL.size))
    for name in ("left_shoulder_flexion", "left_elbow_flexion", "right_hip_flexion"):
        dof[:, MODEL.dof_index[name]] = 0.6 + 0.5 * np.sin(4.0 * t)
    poses = kinematics().pose(dof)
    before, after = poses.rotations[:-1], poses.rotations[1:]
    turned = Rotation.from_matrix((after @ np.swapaxes(before, 2, 3)).reshape(-1, 3, 3))
    rates = turned.as_rotvec().reshape(*before.shape[:2], 3) / PERIOD_S
    rates = np.concatenate([rates[:1], 0.5 * (rates[1:] + rates[:-1]), rates[-1:]])
    found = published_joints(poses, rates)
    assert np.abs(found - poses.positions).max() < 0.002


def test_angles_are_clipped_to_limits_and_held_as_unknown_far_beyond_them():
    t = np.arange(300) * PERIOD_S
    targets = np.radians(60.0) * t  # to 180 degrees
    position, velocity, known, variance = publish(targets, np.full(300, np.radians(60.0)))
    assert position.max() <= LIMITS[1]
    assert known[targets < LIMITS[1] + np.radians(14.0)].all()
    assert not known[targets > LIMITS[1] + np.radians(16.0)].any()
    assert np.ptp(position[-50:]) < np.radians(0.1)
    assert np.abs(velocity[-50:]).max() < 0.01
    assert variance[-1] > variance[-50] > np.radians(20.0) ** 2
    assert np.degrees(unexplained(position, velocity).max()) < 1.0


def test_alternating_biased_sources_cause_no_steps():
    saw = np.where(np.arange(400) // 2 % 2, np.radians(1.5), np.radians(-1.5))
    position, velocity, *_ = publish(saw, np.zeros(400))
    assert np.degrees(unexplained(position, velocity).max()) < 1.2
    assert np.ptp(position[100:]) < np.ptp(saw)


def test_the_output_grid_yields_each_instant_of_a_recording_once():
    grid = OutputGrid(100.0, 1.0)
    given = [
        instant
        for stamp_ns in (1_003 * MS, 1_020 * MS, 1_020 * MS + 1, 5_000 * MS, 5_015 * MS)
        for instant in grid.before(stamp_ns)
    ]
    assert given[:2] == [1_010 * MS, 1_020 * MS]
    assert (np.diff(given) > 0).all()
    assert given[-2:] == [5_000 * MS, 5_010 * MS]
    assert len(given) == 2 + 100 + 2 - 1 or len(given) == 2 + 100 + 2


@pytest.mark.parametrize("rate", [30.0, 100.0, 200.0])
def test_live_output_has_one_instant_per_period_despite_timer_jitter(rate):
    grid, rng = OutputGrid(rate, 1.0), np.random.default_rng(3)
    period_ns = 10**9 / rate
    given = []
    for k in range(1000):
        now_ns = 10**18 + round(k * period_ns + rng.uniform(-0.2, 0.6) * period_ns)
        instants, skipped = grid.until(now_ns, 50 * MS)
        assert skipped == 0
        assert all(instant <= now_ns for instant in instants)
        given += instants
    assert (np.diff(given) == round(period_ns)).all()
    assert len(given) == pytest.approx(1000, abs=2)


def test_of_a_backlog_only_the_newest_instants_are_published_and_the_rest_is_counted():
    grid = OutputGrid(100.0, 1.0)
    grid.until(10**18, 50 * MS)
    instants, skipped = grid.until(10**18 + 8_000 * MS, 50 * MS)
    assert (len(instants), skipped) == (5, 795)
    assert 0 <= 10**18 + 8_000 * MS - instants[-1] < 10 * MS
