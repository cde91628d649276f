"""Calibration of virtual Kinects by a person who follows the instructions."""

import numpy as np
import pytest

from pose_bench.sessions import SessionSpec, bench_session
from pose_calibration.session_calibration import calibrate
from pose_core.transforms import inverse


@pytest.mark.parametrize("seed", [21, 22])
def test_a_person_who_walks_about_gives_the_place_within_15_mm_and_07_degrees(seed):
    spec = SessionSpec(
        choreography="walk_about", level="typical", seed=seed, clock_offset_s=0.3 * (seed - 21.5)
    )
    session = bench_session(spec, imus=False)
    found = calibrate(session.skeletons, session.extrinsics.sensors).extrinsics
    T_true, T_found = (e.T_reference_sensor["right"] for e in (session.extrinsics, found))
    off = inverse(T_true) @ T_found
    angle_rad = np.arccos(np.clip(0.5 * (np.trace(off[:3, :3]) - 1.0), -1.0, 1.0))
    assert np.linalg.norm(T_found[:3, 3] - T_true[:3, 3]) < 0.015
    assert np.degrees(angle_rad) < 0.7
