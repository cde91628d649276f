"""Calibration of a whole session."""

from dataclasses import replace

import numpy as np
import pytest
from walking_person import LEFT, RIGHT, angle_deg, mirrored, samples, with_bent_knees

from pose_calibration.extrinsics.mirrored import refuse_mirrored
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.session_calibration import (
    calibrate,
    calibrate_people,
    complete,
    moved_sensors,
)
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_core.streams.clocks import IMUS
from pose_core.streams.samples import ImuSample, block_of
from pose_core.transforms import inverse

TRUE = inverse(LEFT) @ RIGHT


def test_a_session_gives_extrinsics_floor_and_clock_offset():
    session = calibrate(samples(offset_s={"right": 0.08}), ["left", "right"])
    extrinsics = session.extrinsics
    assert angle_deg(extrinsics.T_reference_sensor["right"], TRUE) < 0.2
    assert extrinsics.clocks["right"].offset_ns == pytest.approx(80e6, abs=4e6)
    assert "left" not in extrinsics.clocks
    assert extrinsics.T_map_reference[2, 3] == pytest.approx(LEFT[2, 3], abs=0.03)


def test_with_a_clock_offset_the_views_agree_as_well_as_without():
    found = calibrate(samples(offset_s={"right": 0.2}), ["left", "right"]).extrinsics
    alike = calibrate(samples(), ["left", "right"]).extrinsics
    assert found.residuals["right"].median < 1.1 * alike.residuals["right"].median


def test_the_order_of_the_samples_is_irrelevant():
    some = samples(duration_s=10.0)
    shuffled = [some[i] for i in np.random.default_rng(0).permutation(len(some))]
    first = calibrate(some, ["left", "right"]).extrinsics
    second = calibrate(shuffled, ["left", "right"]).extrinsics
    for name in ("left", "right"):
        assert first.T_map_sensor(name).tobytes() == second.T_map_sensor(name).tobytes()


def test_a_sensor_without_skeletons_is_named():
    some = [one for one in samples(duration_s=4.0) if one.sensor == "left"]
    with pytest.raises(CalibrationError, match="found no skeletons of 'right'"):
        calibrate(some, ["left", "right"])


@pytest.mark.parametrize("positions", [np.full((15, 3), np.nan), np.zeros((15, 3))])
def test_a_sensor_that_shows_nobody_is_named(positions):
    some = [
        replace(one, positions=positions) if one.sensor == "right" else one
        for one in samples(duration_s=4.0)
    ]
    with pytest.raises(CalibrationError, match="no skeleton of 'right' shows anybody"):
        calibrate(some, ["left", "right"])


def test_samples_of_other_sensors_are_left_out():
    session = calibrate(samples(duration_s=10.0), ["right"])
    assert session.extrinsics.sensors == ("right",)
    assert session.clock_offsets == {}


def test_single_samples_of_imus_are_used_as_blocks_are():
    alone = [
        ImuSample(
            stamp_ns=NS_PER_S + row * 10_000_000,
            segment="left_thigh",
            orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            orientation_stddev=np.full(3, 0.02),
            angular_velocity=np.zeros(3),
        )
        for row in range(500)
    ]
    some = samples(duration_s=10.0)
    first = calibrate([*some, *alone], ["left", "right"])
    second = calibrate([*some, *map(block_of, alone)], ["left", "right"])
    assert first.imus is not None
    np.testing.assert_array_equal(
        first.extrinsics.T_map_reference, second.extrinsics.T_map_reference
    )


def test_data_that_are_mirrored_are_refused():
    some = mirrored(with_bent_knees(samples(duration_s=10.0)), "left", "right")
    with pytest.raises(CalibrationError, match=r"knees bend backwards in 100 %.*mirrored"):
        calibrate(some, ["left", "right"])


def test_one_view_with_exchanged_sides_is_not_called_mirrored():
    some = with_bent_knees(samples(duration_s=10.0))
    by_sensor = {name: [one for one in some if one.sensor == name] for name in ("left", "right")}
    refuse_mirrored(by_sensor)
    mirrored(some, "right")
    refuse_mirrored(by_sensor)


def frames(**settings):
    return [[one] for one in samples(**settings)]


def test_views_that_contradict_given_poses_are_named():
    known = calibrate(samples(), ["left", "right"]).extrinsics
    assert moved_sensors(frames(), known) == ()
    T = known.T_reference_sensor["right"].copy()
    T[:3, 3] += 0.1
    turned = replace(known, T_reference_sensor={**known.T_reference_sensor, "right": T})
    (moved,) = moved_sensors(frames(), turned)
    assert moved.sensor == "right"
    assert moved_sensors(samples(duration_s=1.0)[:0], known) == ()


def test_known_poses_are_completed_with_clocks_and_body_measures():
    known = calibrate(samples(), ["left", "right"]).extrinsics
    poses = replace(known, clocks={}, body=None)
    found = complete(frames(offset_s={"right": -0.17}), poses)
    assert set(found.clocks) == {"right"}
    assert found.clocks["right"].offset_ns == pytest.approx(-170e6, abs=4e6)
    np.testing.assert_allclose(found.body.shape.offsets, known.body.shape.offsets, atol=0.005)
    again = complete(frames(offset_s={"right": -0.3}), found)
    assert again.clocks == found.clocks
    assert again.body is found.body


def test_an_offset_as_small_as_a_trackers_lag_is_no_clocks():
    known = calibrate(samples(), ["left", "right"]).extrinsics
    poses = replace(known, clocks={})
    assert complete(frames(offset_s={"right": 0.002}), poses).clocks == {}


def test_stamps_that_are_farther_apart_than_the_motion_tells_are_refused():
    known = replace(calibrate(samples(), ["left", "right"]).extrinsics, clocks={})
    recorded = [
        [replace(one, stamp_ns=one.stamp_ns + 61 * NS_PER_S) if one.sensor == "right" else one]
        for one in samples()
    ]
    message = r"the stamps of 'right' are \+61.0 s from those of"
    with pytest.raises(InputError, match=message):
        complete(recorded, known)
    with pytest.raises(InputError, match=message):
        calibrate_people(recorded, ["left", "right"])


def test_imus_whose_stamps_are_that_far_apart_get_the_clock_of_what_was_recorded_with_them():
    known = replace(calibrate(samples(), ["left", "right"]).extrinsics, clocks={})
    recorded = [each for one in samples() for each in ([one], imu_at(one.stamp_ns + 61 * NS_PER_S))]
    for found in (
        complete(recorded, known),
        calibrate_people(recorded, ["left", "right"]).extrinsics,
    ):
        assert found.clocks[IMUS].offset_ns == pytest.approx(61 * NS_PER_S, abs=20_000_000)
        assert found.clocks[IMUS].stddev_s == pytest.approx(0.1)


def test_a_reference_that_sees_nobody_for_most_of_a_recording_makes_no_clock_wrong():
    known = replace(calibrate(samples(), ["left", "right"]).extrinsics, clocks={})
    ones = samples()
    begin_ns, end_ns = ones[0].stamp_ns, ones[-1].stamp_ns
    leaves_ns = begin_ns + 3 * (end_ns - begin_ns) // 10
    recorded = [
        each
        for one in ones
        for each in (
            [] if one.sensor == "left" and one.stamp_ns > leaves_ns else [one],
            imu_at(one.stamp_ns),
        )
    ]
    assert complete(recorded, known).clocks == {}


def imu_at(stamp_ns):
    return block_of(
        ImuSample(
            stamp_ns=stamp_ns,
            segment="torso",
            orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            orientation_stddev=np.full(3, 0.01),
            angular_velocity=np.zeros(3),
        )
    )
