"""What the accelerations around a joint tell of the headings on either side of it."""

from dataclasses import replace

import numpy as np
import pytest
from jointed_segments import PLACES, START_NS, jointed_imus

from pose_core.imu.joints import JOINTS, WINDOW_NS, ImuJoints
from pose_core.streams.samples import ImuBlock, joined

MINUTE_NS = 60 * 10**9
TURNS = {"left_thigh": 0.4, "left_shank": -1.1}
TRUE = TURNS["left_shank"] - TURNS["left_thigh"]


def fed(*blocks: ImuBlock, rows: int = 20) -> ImuJoints:
    joints = ImuJoints()
    for block in blocks:
        for first in range(0, len(block), rows):
            joints.add(block.rows(slice(first, first + rows)))
    return joints


def turns_of(joints, until_ns=START_NS + MINUTE_NS):
    return joints.until(until_ns)


def errors(turns):
    return np.array([np.remainder(t.turn - TRUE + np.pi, 2.0 * np.pi) - np.pi for t in turns])


def test_a_joint_shows_how_the_two_worlds_are_turned():
    turns = turns_of(fed(jointed_imus(TURNS)))
    assert {(t.parent, t.child) for t in turns} == {("left_thigh", "left_shank")}
    assert len(turns) >= 12
    assert np.degrees(np.abs(errors(turns[3:]))).max() < 1.0


def test_the_joint_s_places_are_found_without_being_told():
    joints = fed(jointed_imus(TURNS))
    row = JOINTS.index(("left_thigh", "left_shank"))
    found = joints._joints.places[row]
    np.testing.assert_allclose(found, np.concatenate(list(PLACES.values())), atol=0.02)


@pytest.mark.parametrize("gravity", [np.zeros(3), np.array([0.3, -0.2, 9.81])])
def test_what_is_felt_at_rest_does_not_matter(gravity):
    """Drivers that take gravity off, and a world that stands a little askew."""
    turns = turns_of(fed(jointed_imus(TURNS, gravity=gravity)))
    assert np.degrees(np.abs(errors(turns[3:]))).max() < 1.0


def test_the_stated_deviation_covers_noise():
    for seed in range(1, 6):
        turns = turns_of(fed(jointed_imus(TURNS, seed=seed, noise=2.0)))[3:]
        stated = np.array([np.sqrt(t.variance) for t in turns])
        assert 0.2 < np.sqrt(np.mean((errors(turns) / stated) ** 2)) < 1.5
        assert np.mean([t.noise for t in turns]) > 0.001


def test_noise_is_told_from_what_is_left_over():
    quiet = np.mean([t.noise for t in turns_of(fed(jointed_imus(TURNS)))[3:]])
    loud = np.mean([t.noise for t in turns_of(fed(jointed_imus(TURNS, noise=2.0)))[3:]])
    assert loud > 5.0 * quiet


def test_who_stands_still_shows_nothing():
    block = jointed_imus(TURNS)
    felt = np.random.default_rng(1).normal([0.0, 0.0, 9.81], 0.05, (len(block), 3))
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (len(block), 1))
    still = replace(block, orientation=upright, linear_acceleration=felt)
    assert turns_of(fed(still)) == []


def test_without_accelerations_nothing_is_shown():
    block = jointed_imus(TURNS)
    unknown = replace(block, linear_acceleration=np.full_like(block.linear_acceleration, np.nan))
    assert turns_of(fed(unknown)) == []


def test_how_samples_are_cut_into_blocks_does_not_matter():
    block = jointed_imus(TURNS)
    first, second = (turns_of(fed(block, rows=rows)) for rows in (7, 250))
    assert first == second


def test_one_imu_s_samples_may_come_after_the_other_s():
    block = jointed_imus(TURNS)
    late = block.stamps_ns + np.where(block.imu == 1, 80_000_000, 0)
    turns = turns_of(fed(block.rows(np.argsort(late, kind="stable"))))
    assert turns == turns_of(fed(block))


def test_a_window_with_a_gap_shows_nothing():
    block = jointed_imus(TURNS)
    window = START_NS // WINDOW_NS + 5
    inside = block.stamps_ns // WINDOW_NS == window
    since_ns = block.stamps_ns % WINDOW_NS
    lost = inside & (block.imu == 0) & (since_ns > 10**9) & (since_ns < 1_700_000_000)
    ends = [t.until_ns // WINDOW_NS - 1 for t in turns_of(fed(block.rows(np.flatnonzero(~lost))))]
    assert window not in ends
    assert {window - 1, window + 1} <= set(ends)


def test_a_clock_that_is_set_back_begins_anew():
    block = jointed_imus(TURNS)
    earlier = replace(block, stamps_ns=block.stamps_ns - 10 * MINUTE_NS)
    turns = turns_of(fed(block, earlier), START_NS - 9 * MINUTE_NS)
    assert len(turns) >= 12
    assert np.degrees(np.abs(errors(turns))).max() < 1.0


def test_what_waits_is_forgotten_where_an_imu_begins_anew():
    joints = fed(jointed_imus(TURNS))
    joints.forget("left_shank")
    assert turns_of(joints) == []


def test_each_turn_is_told_once_and_not_before_it_is_late_enough():
    joints = fed(jointed_imus(TURNS))
    first = joints.until(START_NS + MINUTE_NS // 2)
    rest = joints.until(START_NS + MINUTE_NS)
    assert first
    assert rest
    assert max(t.until_ns for t in first) <= START_NS + MINUTE_NS // 2 < rest[-1].until_ns
    assert joints.until(START_NS + MINUTE_NS) == []


def test_segments_that_no_joint_connects_are_passed_over():
    block = replace(jointed_imus(TURNS), segments=("left_hand", "left_shank"))
    assert turns_of(fed(block)) == []


def test_a_worn_pelvis_stands_between_trunk_and_thigh():
    block = replace(jointed_imus(TURNS), segments=("torso", "left_thigh"))
    upper = replace(block.rows(np.flatnonzero(block.imu == 0)), segments=("pelvis", "left_thigh"))
    alone, with_pelvis = fed(block), fed(joined([upper, block]), rows=2 * len(block))
    assert {(t.parent, t.child) for t in turns_of(alone)} == {("torso", "left_thigh")}
    pairs = {(t.parent, t.child) for t in turns_of(with_pelvis)}
    assert ("pelvis", "left_thigh") in pairs
    assert ("torso", "left_thigh") not in pairs
