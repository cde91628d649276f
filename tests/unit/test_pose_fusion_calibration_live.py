"""Calibration while the person moves."""

from dataclasses import replace

import numpy as np
import pytest
from walking_person import LEFT, POSES, RIGHT, angle_deg, samples

from pose_fusion.calibration.extrinsics import extrinsics_from_map
from pose_fusion.calibration.live_calibration import CalibrationState, LiveCalibration
from pose_fusion.calibration.parameters import CalibrationParameters, LiveCalibrationParameters
from pose_fusion.calibration.rigid_transform import inverse

TRUE = inverse(LEFT) @ RIGHT


def feed(calibration, some):
    """The calibrations that samples give, with the seconds at which they came."""
    given = [(one.stamp_ns * 1e-9 - 1.0, calibration.add([one])) for one in some]
    return [(time_s, extrinsics) for time_s, extrinsics in given if extrinsics is not None]


def test_the_first_solution_comes_once_the_motion_suffices_and_one_refinement_later():
    calibration = LiveCalibration(
        LiveCalibrationParameters(minimum_duration=2.0, collect_duration=10.0)
    )
    (first_s, first), (second_s, second) = feed(calibration, samples(duration_s=15.0, noise=0.02))
    assert 2.0 <= first_s < 5.0
    assert second_s == pytest.approx(10.0, abs=0.3)
    assert calibration.state is CalibrationState.REFINED
    assert calibration.extrinsics is second
    errors = [angle_deg(each.T_reference_sensor["right"], TRUE) for each in (first, second)]
    assert errors[0] < 0.6
    assert errors[1] < 0.2


def test_while_the_person_stands_still_the_status_says_what_to_do():
    calibration = LiveCalibration(LiveCalibrationParameters())
    still = samples(duration_s=6.0, walks=False, moves=False, noise=0.003)
    assert feed(calibration, still) == []
    assert calibration.state is CalibrationState.COLLECTING
    assert "too little motion" in calibration.status
    assert calibration.counters["refused_solutions"] >= 2


def test_a_silent_sensor_is_named():
    calibration = LiveCalibration(LiveCalibrationParameters())
    feed(calibration, [one for one in samples(duration_s=3.0) if one.sensor == "left"])
    assert calibration.status == "collecting: no skeletons from right yet"


def test_frames_with_several_persons_are_left_out_and_counted():
    calibration = LiveCalibration(LiveCalibrationParameters())
    for one in samples(duration_s=5.0):
        assert calibration.add([one, replace(one, person="2")]) is None
    assert calibration.selector.counters["several_persons"] == 300
    assert calibration.calibrator.frames_in == 0


def test_a_named_person_is_taken_from_frames_with_several():
    calibration = LiveCalibration(LiveCalibrationParameters(person="1"))
    stranger = np.full((15, 3), 7.0)
    given = [
        calibration.add([replace(one, person="2", positions=stranger), one])
        for one in samples(duration_s=8.0)
    ]
    (extrinsics,) = [each for each in given if each is not None]
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.5


def test_a_known_calibration_is_kept():
    known = extrinsics_from_map(POSES)
    calibration = LiveCalibration(LiveCalibrationParameters(), known)
    assert feed(calibration, samples(duration_s=8.0)) == []
    assert calibration.extrinsics is known
    assert calibration.status == "loaded"


def test_a_restart_finds_a_new_calibration_and_keeps_the_old_one_until_then():
    known = extrinsics_from_map({name: np.eye(4) for name in POSES})
    calibration = LiveCalibration(LiveCalibrationParameters(), known)
    calibration.restart()
    assert calibration.extrinsics is known
    assert calibration.status.startswith("collecting")
    assert len(feed(calibration, samples(duration_s=8.0))) == 1
    assert angle_deg(calibration.extrinsics.T_reference_sensor["right"], TRUE) < 0.5


def test_the_parameters_become_limits_and_mounting():
    parameters = CalibrationParameters(
        minimum_frames=33, mounting="known_height", sensor_tilt=0.2, sensor_height=1.5
    )
    assert parameters.limits.minimum_frames == 33
    assert parameters.known_mounting.height == 1.5
    assert parameters.known_mounting.tilt is None
    assert CalibrationParameters().known_mounting.height is None
