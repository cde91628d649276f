"""A slipped strap is found by a segment's axes, whatever the alignment and the cameras' offsets."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.slip_check import SlipCheck
from pose_core.joints import JOINT_INDEX, JOINTS

SEGMENTS = ("left_thigh", "torso")
PERIOD_NS = 33_333_333
SLIP_S, UNTIL_S = 15.0, 21.0
AXES = {"along": [0.0, 0.0, 1.0], "across": [1.0, 0.0, 0.0]}


def joints_of(thigh, knee_bend, trunk):
    """A hip, a knee that bends, a foot, and a trunk with shoulders."""
    joints = np.full((len(JOINTS), 3), np.nan)
    shank = thigh * Rotation.from_euler("y", knee_bend)
    down, up = np.array([0.0, 0.0, -0.4]), np.array([0.0, 0.0, 0.25])
    joints[JOINT_INDEX["left_hip"]] = [0.0, 0.1, 0.9]
    joints[JOINT_INDEX["left_knee"]] = joints[JOINT_INDEX["left_hip"]] + thigh.apply(down)
    joints[JOINT_INDEX["left_foot"]] = joints[JOINT_INDEX["left_knee"]] + shank.apply(down)
    joints[JOINT_INDEX["torso"]] = [0.0, 0.0, 1.1]
    joints[JOINT_INDEX["neck"]] = joints[JOINT_INDEX["torso"]] + trunk.apply(up)
    for side, y in (("left", 0.18), ("right", -0.18)):
        joints[JOINT_INDEX[f"{side}_shoulder"]] = joints[JOINT_INDEX["neck"]] + trunk.apply(
            [0.0, y, 0.0]
        )
    return joints


def found(
    degrees,
    axis,
    slips=SEGMENTS[:1],
    *,
    cameras=2,
    cameras_err_from_s=np.inf,
    is_aligned=True,
    lost=0.0,
    foot_errs=0.0,
    are_blind=False,
):
    """Segments found if some IMUs slip; or if the first camera errs from an instant on.

    ``lost`` is the share of instants without a sample, of each IMU. From the slip on, all cameras
    see the foot aside by ``foot_errs`` [m], and scattered by as much; all but the first may be
    blind.
    """
    rng, check = np.random.default_rng(1), SlipCheck()
    alignments, headings = Rotation.random(2, random_state=2), np.array([1.0, -0.5])
    offsets = rng.normal(0.0, 0.02, (cameras, len(JOINTS), 3))
    slip = Rotation.from_rotvec(np.radians(degrees) * np.array(AXES[axis]))
    step_ns = PERIOD_NS // cameras
    for k in range(int(UNTIL_S / (step_ns * 1e-9))):
        t = k * step_ns * 1e-9
        thigh = Rotation.from_euler("zy", [0.2 * t, -0.4 * np.sin(2.0 * t)])
        trunk = Rotation.from_euler("zx", [0.2 * t, 0.2 * np.sin(1.3 * t)])
        truth = joints_of(thigh, 1.0 - 0.4 * np.cos(2.0 * t), trunk)
        slipped = [
            slip if name in slips and t > SLIP_S else Rotation.identity() for name in SEGMENTS
        ]
        R = [
            Rotation.from_euler("z", -heading) * each * turn * alignment
            for each, turn, alignment, heading in zip(
                (thigh, trunk), slipped, alignments, headings, strict=True
            )
        ]
        here = np.flatnonzero(rng.random(2) >= lost)
        measured = ImuMeasurements(
            segments=tuple(SEGMENTS[row] for row in here),
            R_world_sensor=np.array([each.as_matrix() for each in R])[here],
            angular_velocity=np.full((2, 3), 0.5)[here],
            stddev=np.full((2, 3), 0.02)[here],
            age_s=np.zeros(2)[here],
        )
        positions = truth + offsets + rng.normal(0.0, 0.02, offsets.shape)
        if t > SLIP_S:
            positions[:, JOINT_INDEX["left_foot"]] += rng.normal([0.0, foot_errs, 0.0], foot_errs)
        if t > cameras_err_from_s:
            turn = Rotation.from_euler("x", 30.0, degrees=True)
            positions[0] = joints_of(thigh * turn, 0.5, trunk * turn)
        sees = k % cameras  # one camera's frame at a time
        positions[np.arange(cameras) != sees] = np.nan
        if are_blind:
            positions[1:] = np.nan
        known = headings if is_aligned else np.full(2, np.nan)
        check.add(10**18 + k * step_ns, positions, measured, known[here])
    return set(check.slipped)


@pytest.mark.parametrize("segment", SEGMENTS)
@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("cameras", [2, 3])
def test_a_slip_of_30_degrees_is_found_within_ten_seconds(axis, cameras, segment):
    assert found(30.0, axis, (segment,), cameras=cameras) == {segment}


@pytest.mark.parametrize("lost", [0.05, 0.3])
def test_lost_samples_do_not_hide_a_slip(lost):
    assert found(30.0, "across", lost=lost) == set(SEGMENTS[:1])
    assert found(0.0, "across", lost=lost) == set()


def test_several_at_once_are_an_error_of_the_cameras():
    assert found(30.0, "across", SEGMENTS) == set()


@pytest.mark.parametrize("axis", AXES)
def test_soft_tissue_is_no_slip(axis):
    assert found(8.0, axis, SEGMENTS) == set()


def test_cameras_that_contradict_each_other_accuse_nobody():
    assert found(0.0, "across") == set()
    assert found(0.0, "across", cameras_err_from_s=SLIP_S) == set()


def test_a_foot_that_scatters_and_one_camera_of_several_tell_no_slip():
    assert found(0.0, "across", foot_errs=0.4) == set()
    assert found(30.0, "across", are_blind=True) == set()


def test_imus_that_are_not_aligned_are_not_judged():
    assert found(30.0, "across", is_aligned=False) == set()


def test_the_measurements_before_an_alignment_are_forgotten():
    check = SlipCheck()
    check.forget("left_thigh")
    assert check.slipped == ()
