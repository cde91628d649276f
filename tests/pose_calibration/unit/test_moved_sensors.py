"""A sensor that is moved during a recording is found, and when."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from walking_person import POSES, frames, sensor_pose

from pose_calibration.extrinsics.moved_sensors import find_moved, find_moved_or_displaced
from pose_core.session.extrinsics import extrinsics_from_map

HALF_S = 50.0
HALF_NS = 50_000_000_000


def recording(*poses):
    """Samples with each of these poses in turn."""
    found = []
    for part, each in enumerate(poses):
        walk = frames(duration_s=HALF_S, noise=0.02, seed=1 + part, poses=each)
        for frame in walk:
            later = frame.samples.items()
            found.append(
                {n: replace(one, stamp_ns=one.stamp_ns + part * HALF_NS) for n, one in later}
            )
    return by_sensor(found)


def by_sensor(frames):
    """Samples by sensor, of frames by sensor."""
    return {name: [frame[name] for frame in frames if name in frame] for name in frames[0]}


def bumped(sensor, poses=POSES):
    T = poses[sensor].copy()
    T[:3, :3] = Rotation.from_euler("z", 1.0, degrees=True).as_matrix() @ T[:3, :3]
    T[:3, 3] += [0.0, 0.02, 0.0]
    return {**poses, sensor: T}


def test_a_camera_bumped_by_one_degree_is_found_within_a_window():
    (moved,) = find_moved(recording(POSES, bumped("right")), extrinsics_from_map(POSES))
    assert moved.sensors == ("left", "right")
    assert moved.at_s == pytest.approx(HALF_S, abs=10.0)
    assert np.degrees(moved.angle) == pytest.approx(1.0, abs=0.4)
    assert "'left' or 'right' was moved at about 0:" in str(moved)


@pytest.mark.parametrize("sensor", ["left", "back"])
def test_of_three_sensors_the_moved_one_is_named(sensor):
    poses = {**POSES, "back": sensor_pose(5.0, 0.5, 1.1, 170.0)}
    (moved,) = find_moved(recording(poses, bumped(sensor, poses)), extrinsics_from_map(poses))
    assert moved.sensors == (sensor,)


@pytest.mark.parametrize("sensor", ["left", "back"])
def test_each_motion_is_named(sensor):
    poses = {**POSES, "back": sensor_pose(5.0, 0.5, 1.1, 170.0)}
    once = bumped(sensor, poses)
    walked = recording(poses, once, bumped(sensor, once))
    moved = find_moved(walked, extrinsics_from_map(poses))
    assert [each.sensors for each in moved] == [(sensor,)] * 2
    assert [each.at_s for each in moved] == pytest.approx([HALF_S, 2.0 * HALF_S], abs=10.0)


def test_sensors_that_stand_still_are_not_named():
    assert find_moved(recording(POSES, POSES), extrinsics_from_map(POSES)) == ()


def test_a_short_recording_says_nothing():
    some = by_sensor([f.samples for f in frames(duration_s=20.0, noise=0.02, seed=1)])
    assert find_moved(some, extrinsics_from_map(POSES)) == ()


def test_a_sensor_moved_since_its_calibration_is_named_by_how_far_its_view_is():
    walk = frames(duration_s=20.0, rate=30.0, noise=0.02, seed=1)
    some = by_sensor([frame.samples for frame in walk])
    assert find_moved_or_displaced(some, extrinsics_from_map(POSES)) == ()
    T = POSES["right"].copy()
    T[:3, 3] += [0.0, 0.15, 0.0]
    (displaced,) = find_moved_or_displaced(some, extrinsics_from_map({**POSES, "right": T}))
    assert (displaced.sensor, displaced.reference) == ("right", "left")
    assert displaced.distance == pytest.approx(0.15, abs=0.02)
    assert "15 cm from that of 'left'" in str(displaced)
