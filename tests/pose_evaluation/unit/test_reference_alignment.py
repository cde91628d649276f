from dataclasses import replace

import numpy as np
import pytest
from moving_body import motion, raise_limb, standing

from pose_core.errors import InputError
from pose_core.streams.angle_series import angle_series
from pose_core.streams.series import SkeletonSeries
from pose_evaluation.reference_alignment import align_reference
from pose_io.references.reference import reference_of_skeleton

WALL_CLOCK_S = 1.7e9


def reference(**kind):
    return reference_of_skeleton("vicon.c3d", motion(**kind))


def recording(begin_s=0.0, duration_s=12.0):
    """Whoever moves as the reference does, on the wall clock, from 30 Hz frames with noise."""
    seen = motion(rate=30.0, begin_s=begin_s, duration_s=duration_s)
    noise = np.random.default_rng(5).normal(0.0, 0.01, seen.positions.shape)
    stamps_ns = seen.stamps_ns + round(WALL_CLOCK_S * 1e9)
    return angle_series(replace(seen, positions=seen.positions + noise, stamps_ns=stamps_ns))


@pytest.mark.parametrize("begin_s", [0.0, 2.345, 4.0])
def test_a_reference_on_its_own_clock_is_found_in_the_recording(begin_s):
    found = recording(begin_s=begin_s)
    moved, alignment = align_reference(reference(), found)
    shift_s = (int(moved.angles.stamps_ns[0]) - round(WALL_CLOCK_S * 1e9)) * 1e-9
    assert shift_s == pytest.approx(0.0, abs=0.005)
    assert alignment.begins_at_s == pytest.approx(-begin_s, abs=0.005)
    assert not alignment.shares_clock
    assert alignment.correlation > 0.95


def test_joints_and_angles_are_moved_alike():
    moved, _ = align_reference(reference(), recording(begin_s=1.0))
    assert moved.skeleton.stamps_ns.tolist() == moved.angles.stamps_ns.tolist()


def test_a_recording_that_is_shorter_is_found_inside_the_reference():
    _, alignment = align_reference(reference(duration_s=20.0), recording(6.0, duration_s=5.0))
    assert alignment.begins_at_s == pytest.approx(-6.0, abs=0.01)


def test_a_reference_on_the_recording_s_clock_stays_where_it_is():
    series = angle_series(motion(rate=30.0, begin_s=0.5))
    moved, alignment = align_reference(reference(), series)
    assert alignment.shares_clock
    assert moved.angles.stamps_ns[0] == reference().angles.stamps_ns[0]
    assert alignment.begins_at_s == pytest.approx(-0.5)


def test_angles_with_gaps_are_aligned_too():
    gappy = motion()
    gappy.positions[200:500] = np.nan
    _, alignment = align_reference(reference_of_skeleton("gappy", gappy), recording(2.0))
    assert alignment.begins_at_s == pytest.approx(-2.0, abs=0.01)


def test_a_reference_with_some_angles_is_aligned_without_a_warning(recwarn):
    whole = reference()
    known = ("left_hip_abduction", "right_knee_flexion", "right_shoulder_flexion")
    angles = {
        n: a if n in known else np.full_like(a, np.nan) for n, a in whole.angles.angles.items()
    }
    some = replace(whole, angles=replace(whole.angles, angles=angles), skeleton=None)
    _, alignment = align_reference(some, recording(2.0))
    assert alignment.begins_at_s == pytest.approx(-2.0, abs=0.02)
    assert not recwarn.list


def test_another_motion_is_refused():
    other = motion(rate=30.0)
    rng = np.random.default_rng(3)
    steps = np.cumsum(rng.normal(0.0, 0.02, other.positions.shape), axis=0)
    stamps_ns = other.stamps_ns + round(WALL_CLOCK_S * 1e9)
    strange = replace(other, positions=other.positions + steps, stamps_ns=stamps_ns)
    with pytest.raises(InputError, match="shows another motion than the recording"):
        align_reference(reference(), angle_series(strange))


def test_somebody_who_stands_still_cannot_be_aligned():
    still = SkeletonSeries(
        stamps_ns=np.arange(300) * 10_000_000,
        positions=standing(300),
        tracking_state=np.full((300, 15), 2, np.uint8),
    )
    with pytest.raises(InputError, match="cannot be aligned in time"):
        align_reference(reference_of_skeleton("still", still), recording())


def raising_arms_sideways(series, crossed):
    """Adds both arms up sideways and down again, whose flexion meanwhile crosses ±180° or not."""
    times = series.stamps_ns * 1e-9
    raised = 1.4 * (1.0 - np.cos(1.1 * times))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        chain = [f"{side}_elbow", f"{side}_hand"]
        swing = 0.1 * np.sign(crossed) * np.sin(1.1 * times)  # in front, behind
        raise_limb(series.positions, f"{side}_shoulder", chain, swing, False)
        raise_limb(series.positions, f"{side}_shoulder", chain, sign * raised, True)
    return series


def test_an_arm_raised_sideways_does_not_move_the_reference():
    raising = raising_arms_sideways(motion(), crossed=1)
    found = raising_arms_sideways(motion(rate=30.0, begin_s=2.0), crossed=-1)
    stamps_ns = found.stamps_ns + round(WALL_CLOCK_S * 1e9)
    found = angle_series(replace(found, stamps_ns=stamps_ns))
    _, alignment = align_reference(reference_of_skeleton("raising", raising), found)
    assert alignment.begins_at_s == pytest.approx(-2.0, abs=0.02)
