"""Exchanged IMUs are found from the limbs' directions, whatever their alignments and headings."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.imu.exchange_check import PERIOD_NS, ExchangeCheck
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.joints import JOINT_INDEX, JOINTS

SEGMENTS = ("left_thigh", "left_shank", "right_thigh", "right_shank", "left_forearm")
THIGHS = {"left_thigh": "right_thigh", "right_thigh": "left_thigh"}  # what is found
THIGHS_EXCHANGED = ("right_thigh", "left_shank", "left_thigh", "right_shank", "left_forearm")
SECONDS = 30.0


def legs(t, is_planar):
    """Rotation of each segment in map: two legs that step in turn, and a forearm."""
    swing, phase = 0.4 * np.sin(2.0 * t), 0.5 * np.sin(2.0 * t + 1.0)
    angles = (swing, swing - 0.5 - phase, -swing, -swing - 0.5 + phase, 0.5 + 0.3 * np.sin(3.0 * t))
    if is_planar:  # so that half a turn exchanges left and right
        return [Rotation.from_euler("y", -angle) for angle in angles]
    sideways = 0.3 * np.sin(1.3 * t)
    turn = Rotation.from_euler("z", 0.2 * t)
    return [turn * Rotation.from_euler("xy", [sideways, -angle]) for angle in angles]


def joints_of(rotations):
    joints = np.full((len(JOINTS), 3), np.nan)
    down = np.array([0.0, 0.0, -0.4])
    for side, y in (("left", 0.1), ("right", -0.1)):
        joints[JOINT_INDEX[f"{side}_hip"]] = [0.0, y, 0.9]
    thigh, shank, other_thigh, other_shank, forearm = rotations
    joints[JOINT_INDEX["left_knee"]] = joints[JOINT_INDEX["left_hip"]] + thigh.apply(down)
    joints[JOINT_INDEX["left_foot"]] = joints[JOINT_INDEX["left_knee"]] + shank.apply(down)
    joints[JOINT_INDEX["right_knee"]] = joints[JOINT_INDEX["right_hip"]] + other_thigh.apply(down)
    joints[JOINT_INDEX["right_foot"]] = joints[JOINT_INDEX["right_knee"]] + other_shank.apply(down)
    joints[JOINT_INDEX["left_elbow"]] = [0.0, 0.2, 1.1]
    joints[JOINT_INDEX["left_hand"]] = joints[JOINT_INDEX["left_elbow"]] + forearm.apply(down)
    return joints


def found(
    worn, seconds=SECONDS, slips_at=None, lost=0.0, is_planar=False, north=0.02, headings=(1.0,) * 5
):
    """What is found if the IMU called SEGMENTS[k] is worn on worn[k].

    ``lost`` is the share of instants without a sample, of each IMU; ``north`` the standard
    deviation of its heading [rad].
    """
    rng = np.random.default_rng(1)
    alignments, check = Rotation.random(5, random_state=2), ExchangeCheck()
    worlds = Rotation.from_euler("z", np.reshape(headings, (5, 1)))
    for k in range(int(seconds / (PERIOD_NS * 1e-9))):
        stamp_ns = 10**18 + k * PERIOD_NS
        rotations = legs(k * PERIOD_NS * 1e-9, is_planar)
        R = [
            (world * rotations[SEGMENTS.index(name)] * alignment).as_matrix()
            for name, world, alignment in zip(worn, worlds, alignments, strict=True)
        ]
        here = np.flatnonzero(rng.random(5) >= lost)
        states = ImuMeasurements(
            segments=tuple(SEGMENTS[row] for row in here),
            R_world_sensor=np.array(R)[here],
            angular_velocity=np.full((5, 3), 0.5)[here],
            stddev=np.tile([0.02, 0.02, north], (5, 1))[here],
            age_s=np.zeros(5)[here],
            slips={"left_thigh": 1} if slips_at is not None and k >= slips_at else {},
        )
        positions = joints_of(rotations) + rng.normal(0.0, 0.02, (len(JOINTS), 3))
        check.add(stamp_ns, positions[None], states)
    return check.exchanged()


def test_imus_on_their_own_segments_are_not_accused():
    assert found(SEGMENTS) == {}


@pytest.mark.parametrize(("i", "j"), [(0, 1), (0, 2), (1, 2)])
def test_exchanged_imus_are_named_with_each_other(i, j):
    worn = list(SEGMENTS)
    worn[i], worn[j] = worn[j], worn[i]
    assert found(worn) == {SEGMENTS[i]: SEGMENTS[j], SEGMENTS[j]: SEGMENTS[i]}


def test_who_walks_straight_has_exchanged_legs_if_their_headings_disagree_with_the_others():
    assert found(THIGHS_EXCHANGED, is_planar=True) == THIGHS
    assert found(SEGMENTS, is_planar=True) == {}
    assert found(THIGHS_EXCHANGED, is_planar=True, north=2.0) == {}  # nothing tells


def test_headings_that_differ_although_each_is_said_to_be_north_accuse_nobody():
    assert found(SEGMENTS, is_planar=True, headings=(1.0 + np.pi, 1.0, 1.0 + np.pi, 2.5, 1.0)) == {}


@pytest.mark.parametrize("lost", [0.05, 0.3])
def test_lost_samples_do_not_hide_an_exchange(lost):
    assert found(THIGHS_EXCHANGED, lost=lost) == {
        "left_thigh": "right_thigh",
        "right_thigh": "left_thigh",
    }
    assert found(SEGMENTS, lost=lost) == {}


def test_short_evidence_and_evidence_from_before_a_slip_do_not_count():
    worn = ("left_shank", "left_thigh", "right_thigh", "right_shank", "left_forearm")
    assert found(worn, seconds=1.0) == {}
    assert found(worn, slips_at=int(29.0 / (PERIOD_NS * 1e-9))) == {}
