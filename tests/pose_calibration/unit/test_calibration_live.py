"""Calibration while the person moves."""

from dataclasses import replace

import numpy as np
import pytest
from crowd_of_people import frames_of, walker
from walking_person import (
    LEFT,
    POSES,
    RIGHT,
    angle_deg,
    mirrored,
    person_at,
    samples,
    sensor_pose,
    with_bent_knees,
)

from pose_calibration.extrinsics.parameters import CalibrationParameters
from pose_calibration.live.live_calibration import CalibrationState, LiveCalibration
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.session.extrinsics import extrinsics_from_map
from pose_core.transforms import inverse

TRUE = inverse(LEFT) @ RIGHT


def feed(calibration, some):
    """The calibrations that samples give, with the seconds at which they came."""
    given = [(one.stamp_ns * 1e-9 - 1.0, calibration.add([one])) for one in some]
    return [(time_s, extrinsics) for time_s, extrinsics in given if extrinsics is not None]


def test_the_first_solution_comes_once_the_motion_suffices_and_is_refined_until_time_is_over():
    calibration = LiveCalibration(
        LiveCalibrationParameters(
            minimum_duration=2.0, collect_duration=10.0, enough_rotation_stddev=0.0005
        )
    )
    (first_s, first), *_, (last_s, last) = feed(calibration, samples(duration_s=15.0, noise=0.02))
    assert 2.0 <= first_s < 5.0
    assert last_s == pytest.approx(10.0, abs=0.5)
    assert calibration.state is CalibrationState.REFINED
    assert calibration.extrinsics is last
    errors = [angle_deg(each.T_reference_sensor["right"], TRUE) for each in (first, last)]
    assert errors[0] < 1.0
    assert errors[1] < 0.2


def test_after_a_death_what_had_been_found_is_used_until_the_new_calibration_is_final():
    calibration = LiveCalibration(
        LiveCalibrationParameters(
            minimum_duration=2.0, collect_duration=10.0, enough_rotation_stddev=0.0005
        ),
        known=extrinsics_from_map(POSES),
    )
    calibration.restart(until_final=True)
    assert calibration.status.startswith("calibrated")
    (given,) = feed(calibration, samples(duration_s=15.0, noise=0.02))
    assert given[0] == pytest.approx(10.0, abs=0.5)
    assert calibration.counts["solutions"] > 1
    assert calibration.state is CalibrationState.REFINED


def test_a_calibration_that_is_good_enough_ends_by_itself():
    calibration = LiveCalibration(
        LiveCalibrationParameters(enough_rotation_stddev=0.02, enough_position_stddev=0.1)
    )
    given = feed(calibration, samples(duration_s=10.0))
    assert len(given) == 1
    assert calibration.is_finished
    assert (calibration.progress, calibration.missing) == (1.0, "")


def test_a_single_camera_s_vertical_is_found_anew_for_twenty_seconds():
    calibration = LiveCalibration(LiveCalibrationParameters(sensors=("left",)))
    own = [each for each in samples(duration_s=24.0) if each.sensor == "left"]
    (first_s, first), *_, (last_s, _) = feed(calibration, own)
    assert first.sensors == ("left",)
    assert (first_s, last_s) == pytest.approx((3.0, 20.0), abs=1.1)
    assert calibration.is_finished


def test_before_the_first_solution_there_are_instructions_and_progress():
    calibration = LiveCalibration(LiveCalibrationParameters(enough_position_stddev=0.001))
    feed(calibration, samples(duration_s=8.0))
    assert calibration.state is CalibrationState.CALIBRATED
    assert "'right' is known to" in calibration.missing
    assert "turn to both sides" in calibration.missing
    assert 0.0 < calibration.progress < 1.0
    assert calibration.missing in calibration.status


def test_clock_offsets_are_found_and_taken_off():
    calibration = LiveCalibration(LiveCalibrationParameters(collect_duration=20.0))
    feed(calibration, samples(duration_s=25.0, offset_s={"right": 0.3}))
    found_ns = calibration.extrinsics.clocks["right"].offset_ns
    assert found_ns == pytest.approx(300_000_000, abs=6_000_000)
    assert angle_deg(calibration.extrinsics.T_reference_sensor["right"], TRUE) < 0.4


def arriving(offset_s, duration_s=25.0):
    """Samples of both sensors as they arrive, the right one's clock ahead by ``offset_s`` [s]."""
    ahead_ns = {"left": 0, "right": int(offset_s * 1e9)}
    some = samples(duration_s=duration_s)
    return [replace(one, stamp_ns=one.stamp_ns + ahead_ns[one.sensor]) for one in some]


@pytest.mark.parametrize("offset_s", [-0.3, 0.3])
def test_clock_offsets_are_found_as_the_samples_arrive(offset_s):
    calibration = LiveCalibration(LiveCalibrationParameters(collect_duration=20.0))
    feed(calibration, arriving(offset_s))
    found_ns = calibration.extrinsics.clocks["right"].offset_ns
    assert found_ns == pytest.approx(offset_s * 1e9, abs=6_000_000)
    assert angle_deg(calibration.extrinsics.T_reference_sensor["right"], TRUE) < 0.4


@pytest.mark.parametrize(("offset_s", "text"), [(2.3, "2.3 s ahead of"), (-1.5, "1.5 s behind")])
def test_a_clock_that_is_too_far_from_the_reference_s_is_named(offset_s, text):
    calibration = LiveCalibration(LiveCalibrationParameters())
    assert feed(calibration, arriving(offset_s, duration_s=8.0)) == []
    assert calibration.missing.startswith(f"the clock of 'right' is {text} that of 'left', ")


@pytest.mark.parametrize("offset_s", [-0.45, 0.45])
def test_a_clock_that_differs_is_never_taken_to_be_equal(offset_s):
    """In some seconds of this motion the offset is not observable, and views would not agree."""
    calibration = LiveCalibration(LiveCalibrationParameters(collect_duration=20.0))
    said = set()
    for one in arriving(offset_s):
        calibration.add([one])
        said.add(calibration.missing)
        if calibration.extrinsics is not None:
            clock = calibration.extrinsics.clocks["right"]
            assert clock.offset_ns == pytest.approx(offset_s * 1e9, abs=20_000_000)
    assert any("the motion does not tell by how much" in each for each in said)


def test_a_clock_beyond_the_usual_is_found_with_a_larger_max_offset():
    parameters = LiveCalibrationParameters(collect_duration=20.0, max_offset=3.0)
    calibration = LiveCalibration(parameters)
    feed(calibration, arriving(2.3))
    found_ns = calibration.extrinsics.clocks["right"].offset_ns
    assert found_ns == pytest.approx(2.3e9, abs=6_000_000)


def test_the_reference_s_silence_is_no_difference_of_clocks():
    calibration = LiveCalibration(LiveCalibrationParameters())
    some = samples(duration_s=8.0)
    feed(calibration, [one for one in some if one.sensor == "right" or one.stamp_ns < 2e9])
    assert "clock" not in calibration.missing


def test_a_sensor_that_comes_later_joins():
    poses = {**POSES, "late": sensor_pose(5.0, 0.5, 1.1, 170.0)}
    parameters = LiveCalibrationParameters(sensors=tuple(poses), collect_duration=12.0)
    calibration = LiveCalibration(parameters)
    some = [
        one
        for one in samples(duration_s=25.0, poses=poses)
        if one.sensor != "late" or one.stamp_ns > 9_000_000_000
    ]
    given = [extrinsics.sensors for _, extrinsics in feed(calibration, some)]
    assert given[0] == ("left", "right")
    assert given[-1] == tuple(poses)


def test_the_reference_s_accelerometer_gives_the_vertical():
    calibration = LiveCalibration(LiveCalibrationParameters())
    up = LEFT[2, :3]
    for _ in range(100):
        calibration.accelerometer.add(9.81 * up)
        calibration.accelerometer.add(14.0 * up)  # somebody bumps into it
    feed(calibration, samples(duration_s=8.0))
    floor = calibration.extrinsics.floor
    assert floor.source.startswith("the sensor's accelerometer")
    assert calibration.counts["accelerometer_left_out"] == 100
    np.testing.assert_allclose(floor.T_map_reference[2, :3], up, atol=0.01)
    assert floor.up_stddev < np.radians(0.6)


def moved_right(by=0.05):
    T = RIGHT.copy()
    T[:3, 3] += 0.0, by, 0.0
    return {**POSES, "right": T}


def thinned(some, every):
    """The samples with one in so many of the right sensor's: several frames are aligned at once."""
    right = [one for one in some if one.sensor == "right"]
    left_out = {id(one) for number, one in enumerate(right) if number % every}
    return [one for one in some if id(one) not in left_out]


def bump(every=1, **parameters):
    """A loaded calibration that watches, after the right sensor has been moved by 5 cm."""
    calibration = LiveCalibration(
        LiveCalibrationParameters(**parameters), extrinsics_from_map(POSES)
    )
    feed(calibration, thinned(samples(duration_s=15.0), every))
    assert calibration.moved is None
    later = thinned(samples(duration_s=20.0, poses=moved_right(), seed=1), every)
    feed(calibration, [replace(one, stamp_ns=one.stamp_ns + 15_200_000_000) for one in later])
    return calibration


def test_a_sensor_that_is_moved_before_the_calibration_is_final_is_not_averaged_in():
    calibration = LiveCalibration(LiveCalibrationParameters(enough_rotation_stddev=0.0005))
    feed(calibration, samples(duration_s=28.0))
    moved = moved_right(0.25)
    later = samples(duration_s=40.0, poses=moved, seed=1)
    later = [replace(one, stamp_ns=one.stamp_ns + 28_200_000_000) for one in later]
    said = ""
    for one in later:
        calibration.add([one])
        if calibration.status.startswith("collecting again"):
            said = calibration.status
            assert calibration.moved is not None
    assert "'left' or 'right' has been moved: its view is 2" in said
    assert calibration.counts["moves_noticed"] == 1
    assert calibration.moved is None
    found = calibration.extrinsics.T_reference_sensor["right"]
    assert np.linalg.norm(found[:3, 3] - (inverse(LEFT) @ moved["right"])[:3, 3]) < 0.03


def test_a_moved_sensor_is_reported_until_the_next_calibration():
    calibration = bump()
    assert calibration.counts["moves_noticed"] == 1
    assert "has been moved" in calibration.status
    assert calibration.status.startswith("loaded, but ")


def test_a_camera_that_repeats_one_frame_is_not_taken_for_a_moved_one():
    calibration = LiveCalibration(LiveCalibrationParameters(), extrinsics_from_map(POSES))
    some = samples(duration_s=35.0)
    last = next(one for one in some if one.sensor == "right" and one.stamp_ns > 16_000_000_000)
    for one in some:
        is_frozen = one.sensor == "right" and one.stamp_ns > last.stamp_ns
        calibration.add([replace(one, positions=last.positions) if is_frozen else one])
    assert calibration.moved is None
    assert calibration.counts["frames_repeated"] > 500


@pytest.mark.parametrize("every", [1, 4])
def test_a_moved_sensor_is_calibrated_again_if_that_is_allowed(every):
    calibration = bump(every, recalibrate_when_moved=True)
    true = inverse(LEFT) @ moved_right()["right"]
    found = calibration.extrinsics.T_reference_sensor["right"]
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < 0.03


def test_while_the_person_stands_still_the_status_has_an_instruction():
    calibration = LiveCalibration(LiveCalibrationParameters())
    still = samples(duration_s=6.0, walks=False, moves=False, noise=0.003)
    assert feed(calibration, still) == []
    assert calibration.state is CalibrationState.COLLECTING
    assert "too little motion" in calibration.status
    assert calibration.counts["refused_solutions"] >= 2


def test_a_silent_sensor_is_named():
    calibration = LiveCalibration(LiveCalibrationParameters())
    feed(calibration, [one for one in samples(duration_s=3.0) if one.sensor == "left"])
    assert calibration.status == "collecting: no skeletons from right yet"


@pytest.mark.parametrize("rate", [30, 8])
def test_with_two_people_from_the_start_one_is_found_whose_views_agree(rate):
    calibration = LiveCalibration(LiveCalibrationParameters())
    other = walker((3.2, 0.9), (0.0, 0.0), scale=0.9, phase=2.0)
    frames = frames_of([person_at, other], 24.0, rate=rate)
    first = [persons for persons, _ in frames[:60]]
    assert [calibration.add(persons) for persons in first] == [None] * 60
    assert "several people are detected" in calibration.status
    given = [calibration.add(persons) for persons, _ in frames[60:]]
    extrinsics = [each for each in given if each is not None][-1]
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 1.0
    assert calibration.counts["person/matched"] == 1


def test_a_search_for_the_person_that_fails_is_repeated_less_and_less_often():
    """Only one sensor sees anybody, so no views agree."""
    calibration = LiveCalibration(LiveCalibrationParameters())
    other = walker((3.2, 0.9), (0.0, 0.0), scale=0.9, phase=2.0)
    frames = frames_of([person_at, other], 60.0, rate=8, there=lambda sensor, *_: sensor == "left")
    for persons, _ in frames:
        calibration.add(persons)
    assert calibration.counts["person/not_matched"] == 3  # after 5, 15 and 35 s


def test_a_named_person_is_taken_from_frames_with_several():
    calibration = LiveCalibration(LiveCalibrationParameters(person="1"))
    stranger = np.full((15, 3), 7.0)
    given = [
        calibration.add([replace(one, person="2", positions=stranger), one])
        for one in samples(duration_s=8.0)
    ]
    *_, extrinsics = [each for each in given if each is not None]
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.5


def test_an_id_that_nobody_has_is_named_until_somebody_has_it():
    calibration = LiveCalibration(LiveCalibrationParameters(person="first"))
    frames = samples(duration_s=16.0)
    half = len(frames) // 2
    assert not feed(calibration, frames[:half])
    assert "nobody has the id 'first' (person), only '1'" in calibration.status
    calibration.selector.choose_by("")
    assert feed(calibration, frames[half:])
    assert "nobody" not in calibration.status


def test_mirrored_data_are_refused():
    calibration = LiveCalibration(LiveCalibrationParameters())
    some = mirrored(with_bent_knees(samples(duration_s=10.0)), "left", "right")
    assert not feed(calibration, some)
    assert "knees bend backwards" in calibration.status


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
    assert feed(calibration, samples(duration_s=8.0))
    assert angle_deg(calibration.extrinsics.T_reference_sensor["right"], TRUE) < 0.5


def test_the_parameters_become_the_known_mounting():
    parameters = CalibrationParameters(mounting="known_height", sensor_tilt=0.2, sensor_height=1.5)
    assert parameters.known_mounting.height == 1.5
    assert parameters.known_mounting.tilt is None
    assert CalibrationParameters().known_mounting.height is None
