"""Half an hour of an IMU whose world turns away, seen half of the time (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import add
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import IMU_SEGMENTS, START_NS, imu_samples, merged

from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pipeline import FusionPipeline
from pose_core.imu.heading import HeadingAnchor
from pose_core.kernels.anchors import make_anchors
from pose_core.kernels.heading import relate

STEP_S = 0.1
HALF_HOUR_S = 1800.0
SLOW_ERROR = np.radians(3.0)  # the cameras' error of a direction, alike for half a second
BIAS = np.radians(1.0)  # of that, what stays in the body's frame
OUTLIERS = 0.03


def about_up(angle):
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    c, s = np.cos(angle), np.sin(angle)
    rows = [[c, -s, zero], [s, c, zero], [zero, zero, one]]
    return np.moveaxis(np.array(rows), -1, 0)


def slow_noise(rng, count, stddev, time_constant_s):
    keep = np.exp(-STEP_S / time_constant_s)
    noise = rng.normal(size=(count, 3)) * stddev * np.sqrt(1.0 - keep**2)
    for k in range(1, count):
        noise[k] += keep * noise[k - 1]
    return noise


def world_turn(kind, t, rng):
    """The turn from the IMU's world to map [deg] at the times t."""
    if kind == "absent":  # one degree a minute, and not evenly
        walk = np.cumsum(rng.normal(size=len(t))) * 0.3 * np.sqrt(STEP_S / 60.0)
        return t / 60.0 + walk
    # present but disturbed: it follows a field that bends as the person walks about
    return 6.0 * np.sin(2 * np.pi * t / 1800.0) + 0.5 * np.sin(2 * np.pi * t / 310.0 + 1.0)


def thigh_axes(t, rng):
    """The thigh's z axis, true and as cameras see it, and the heading of the body [rad]."""
    body = np.radians(60.0) * np.sin(2 * np.pi * t / 37.0)
    swing = np.radians(70.0) * np.maximum(0.0, np.sin(2 * np.pi * t / 3.0))
    aside = np.radians(8.0) * np.sin(2 * np.pi * t / 7.0)
    local = np.stack([np.sin(swing), np.sin(aside), np.cos(swing)], axis=1)
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    R = about_up(body)
    true = np.einsum("nij,nj->ni", R, local)
    error = slow_noise(rng, len(t), SLOW_ERROR, 0.5) + np.array([BIAS, -BIAS, 0.0])
    wrong = rng.uniform(size=len(t)) < OUTLIERS
    error[wrong] += rng.normal(size=(int(wrong.sum()), 3))
    seen = true + np.einsum("nij,nj->ni", R, error)
    return true, seen / np.linalg.norm(seen, axis=1, keepdims=True), body


def errors_of(kind, start_deg, seed):
    """Error of the anchored heading [deg], and the anchor.

    Beside the leaning thigh, the hinge of the bent knee is seen, three times as badly.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, HALF_HOUR_S, STEP_S)
    turn = np.radians(start_deg + world_turn(kind, t, rng))
    true, seen, body = thigh_axes(t, rng)
    in_world = np.einsum("nji,nj->ni", about_up(turn), true)
    hinge_error = 3.0 * slow_noise(rng, len(t), SLOW_ERROR, 0.5)[:, 0]
    hinge_map = about_up(body + hinge_error)[:, :, 1]
    is_bent = np.sin(2 * np.pi * t / 3.0) > 0.5
    is_seen = np.sin(2 * np.pi * t / 120.0) >= 0.0
    anchor, errors = HeadingAnchor(), np.full(len(t), np.nan)
    for k in range(len(t)):
        anchor.predict(STEP_S)
        if is_seen[k]:
            anchor.observe_lean(STEP_S, in_world[k], seen[k])
        neutral = anchor.neutral_heading
        if is_seen[k] and is_bent[k] and neutral is not None:
            hinge_world = about_up(np.array([body[k] - turn[k] + turn[0] - neutral]))[0, :, 1]
            anchor.observe_turned(STEP_S, hinge_world, hinge_map[k], 1.0 / 3.0)
        if anchor.heading is not None:
            errors[k] = np.degrees(
                np.remainder(anchor.heading - turn[k] + np.pi, 2 * np.pi) - np.pi
            )
    return t, errors, anchor


@pytest.mark.parametrize("kind", ["absent", "disturbed"])
@pytest.mark.parametrize("start_deg", [0.0, 90.0, 180.0])
def test_the_heading_follows_drift_over_half_an_hour(kind, start_deg):
    t, errors, anchor = errors_of(kind, start_deg, seed=int(start_deg) + 1)
    settled = errors[t > 60.0]
    deviation = np.abs(settled - np.median(settled))
    assert np.mean(deviation < 3.0) > 0.99
    assert np.max(deviation) < 4.0
    assert abs(np.median(settled)) < 2.0  # the cameras' own bias, over the lean
    assert anchor.restarts == 0


def deviations_of_a_shank(seed, *, has_joint):
    """Of a shank's heading from its median [deg], as it drifts.

    A thigh is seen well, the shank three times worse; the knee between them shows their headings'
    difference every four seconds to 3 degrees, 2 degrees beside, whether they are seen or not.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, HALF_HOUR_S, STEP_S)
    anchors = make_anchors(2)
    both = [HeadingAnchor(anchors=anchors, row=row) for row in (0, 1)]
    turns = [np.radians(world_turn("absent", t, rng)) for _ in both]
    limbs = []
    for turn, worse in zip(turns, (1.0, 3.0), strict=True):
        true, seen, _ = thigh_axes(t, rng)
        limbs.append((np.einsum("nji,nj->ni", about_up(turn), true), true + worse * (seen - true)))
    errors = np.full(len(t), np.nan)
    for k in range(len(t)):
        for anchor, (in_world, seen) in zip(both, limbs, strict=True):
            anchor.predict(STEP_S)
            if np.sin(2 * np.pi * t[k] / 120.0) >= 0.0:
                anchor.observe_lean(STEP_S, in_world[k], seen[k])
        if has_joint and k % 40 == 0:
            shown = turns[1][k] - turns[0][k] + np.radians(rng.normal(2.0, 3.0))
            relate(anchors, 1, 0, shown, np.radians(3.0) ** 2, 0.01)
        if both[1].heading is not None:
            errors[k] = np.degrees(both[1].heading - turns[1][k])
    settled = errors[t > 180.0]
    return np.abs(settled - np.median(settled))


def test_a_knee_holds_the_heading_of_a_shank_that_is_seen_badly():
    without, held = (
        np.array([deviations_of_a_shank(seed, has_joint=has_joint).max() for seed in range(1, 6)])
        for has_joint in (False, True)
    )
    assert np.mean(held) < 0.7 * np.mean(without)


@pytest.mark.parametrize("step_deg", [90.0, 180.0])
def test_a_world_that_has_turned_at_once_is_found_again(step_deg):
    """As after a device has begun anew: what rests on the neutral pose stays."""
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 120.0, STEP_S)
    turn = np.radians(np.where(t < 60.0, 20.0, 20.0 + step_deg))
    true, seen, _ = thigh_axes(t, rng)
    in_world = np.einsum("nji,nj->ni", about_up(turn), true)
    anchor = HeadingAnchor()
    for k in range(len(t)):
        anchor.predict(STEP_S)
        anchor.observe_lean(STEP_S, in_world[k], seen[k])
    assert anchor.restarts == 1
    assert abs(np.degrees(np.angle(np.exp(1j * (anchor.heading - turn[-1]))))) < 4.0
    assert np.degrees(anchor.neutral_heading) == pytest.approx(20.0, abs=4.0)


def test_wrongly_seen_joints_do_not_move_a_known_heading():
    anchor = HeadingAnchor()
    anchor.start(0.3, np.radians(2.0))
    lying = np.array([1.0, 0.0, 0.0])
    for _ in range(10):  # a second of limbs exchanged
        anchor.predict(STEP_S)
        anchor.observe_lean(STEP_S, lying, np.array([-1.0, 0.2, 0.0]))
    assert anchor.heading == pytest.approx(0.3, abs=np.radians(4.0))


def swinging(t):
    """An axis that swings forward and back by 40 degrees, twice in three seconds."""
    swing = np.radians(40.0) * np.sin(2 * np.pi * t / 1.5)
    return np.stack([np.sin(swing), np.zeros_like(t), np.cos(swing)], axis=1)


def heading_after(true, seen, step_s):
    """The heading [deg] that an anchor, which begins with 0 degrees, has at the end."""
    anchor = HeadingAnchor()
    anchor.start(0.0, np.radians(10.0))
    for each_true, each_seen in zip(true, seen, strict=True):
        anchor.predict(step_s)
        anchor.observe_lean(step_s, each_true, each_seen)
    return np.degrees(anchor.heading)


def test_slow_errors_of_a_swinging_limb_hardly_turn_its_heading():
    """Errors of 6 degrees that stay alike for a third of a second, in a minute."""
    step_s = 1.0 / 60.0
    t = np.arange(0.0, 60.0, step_s)
    true, keep = swinging(t), np.exp(-3.0 * step_s)
    ends = []
    for seed in range(20):
        error = np.random.default_rng(seed).normal(size=(len(t), 3)) * np.sqrt(1.0 - keep**2)
        for k in range(1, len(t)):
            error[k] += keep * error[k - 1]
        ends.append(heading_after(true, true + np.radians(6.0) * error, step_s))
    assert np.sqrt(np.mean(np.square(ends))) < 1.0


def test_a_heading_is_found_from_the_fresh_parts_alone():
    step_s = 1.0 / 60.0
    true = swinging(np.arange(0.0, 60.0, step_s))
    seen = np.einsum("ij,nj->ni", about_up(np.radians(np.array([5.0])))[0], true)
    assert heading_after(true, seen, step_s) == pytest.approx(5.0, abs=0.3)


def test_an_upright_segment_says_nothing_of_heading():
    anchor = HeadingAnchor()
    for _ in range(100):
        anchor.observe_lean(STEP_S, np.array([0.05, 0.0, 1.0]), np.array([0.0, 0.05, 1.0]))
    assert anchor.heading is None
    assert anchor.stddev == pytest.approx(np.pi)


def without_north(samples):
    """Every IMU's world turned by an angle of its own, which it does not know."""
    turns = dict(zip(IMU_SEGMENTS, np.radians([90.0, 180.0, -90.0, 140.0, 10.0]), strict=True))
    stddev = np.array([0.02, 0.02, np.pi])
    for sample in samples:
        turned = Rotation.from_euler("z", turns[sample.segment])
        orientation = (turned * Rotation.from_quat(sample.orientation)).as_quat()
        yield replace(sample, orientation=orientation, orientation_stddev=stddev)


def test_imus_that_know_no_north_are_brought_into_map_each_by_itself():
    t, dof = motion(14.0)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.01)
    worn = list(without_north(imu_samples(t, dof, np.random.default_rng(5))))
    pipeline = FusionPipeline(FusionParameters(estimator="mean", tracker_delay=0.0), extrinsics())
    for sample in merged(skeletons, worn):
        add(pipeline, sample)
    row = int(13.5 * 30)
    readings = pipeline.imus.read(START_NS + round(t[row] * 1e9))
    rotations = kinematics().pose(dof[row]).rotations
    assert set(readings) >= set(IMU_SEGMENTS) - {"torso"}
    for segment, reading in readings.items():
        true = Rotation.from_matrix(rotations[MODEL.link_names.index(MODEL.segments[segment])])
        error = (true.inv() * Rotation.from_matrix(reading.R_map_segment)).magnitude()
        assert np.degrees(error) < 8.0, segment
        assert reading.stddev.max() < 0.2  # not the half turn that the IMU says
