"""Calibration of virtual Kinects by a person who follows the instructions."""

from dataclasses import replace

import numpy as np
import pytest

from pose_bench.sessions import SessionSpec, bench_session
from pose_calibration.session_calibration import calibrate
from pose_core.joints import OTHER_SIDE
from pose_core.transforms import inverse


@pytest.mark.parametrize("seed", [21, 22])
def test_a_person_who_walks_about_gives_the_place_within_15_mm_and_07_degrees(seed):
    spec = SessionSpec(
        choreography="walk_about", level="typical", seed=seed, clock_offset_s=0.3 * (seed - 21.5)
    )
    session = bench_session(spec, imus=False)
    found = calibrate(session.skeletons, session.extrinsics.sensors).extrinsics
    off_m, off_deg = difference(session.extrinsics, found)
    assert off_m < 0.015
    assert off_deg < 0.7


def test_a_tracker_that_always_exchanges_left_and_right_does_not_turn_its_camera():
    session = bench_session(
        SessionSpec(choreography="leg_lift_march", level="typical", seed=1), imus=False
    )
    some = [
        replace(one, positions=one.positions[OTHER_SIDE]) if one.sensor == "right" else one
        for one in session.skeletons
    ]
    found = calibrate(some, session.extrinsics.sensors).extrinsics
    off_m, off_deg = difference(session.extrinsics, found)
    assert off_m < 0.03
    assert off_deg < 1.0


def difference(true, found):
    """Distance [m] and angle [deg] of the right sensor from its true pose."""
    T_true, T_found = (e.T_reference_sensor["right"] for e in (true, found))
    off = inverse(T_true) @ T_found
    angle_rad = np.arccos(np.clip(0.5 * (np.trace(off[:3, :3]) - 1.0), -1.0, 1.0))
    return np.linalg.norm(T_found[:3, 3] - T_true[:3, 3]), np.degrees(angle_rad)
