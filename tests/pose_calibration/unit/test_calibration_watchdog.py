"""Detection of a moved sensor, without false alarms by a moving person."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from walking_person import POSES, SWAPPED, frames, sensor_pose, with_positions

from pose_calibration.live.watchdog import Watchdog
from pose_core.session.extrinsics import extrinsics_from_map

BEFORE_S, AFTER_S = 20.0, 5.0


def watch(before, after, poses=POSES, pause_s=0.066):
    """What is noticed, with the seconds after the change at which it was."""
    watchdog = Watchdog(extrinsics_from_map(poses))
    first_ns = before[-1].stamp_ns
    for frame in before:
        assert watchdog.add(frame) is None
    for frame in after:
        shifted_ns = frame.stamp_ns - after[0].stamp_ns + first_ns + round(pause_s * 1e9)
        moved = watchdog.add(type(frame)(stamp_ns=shifted_ns, samples=frame.samples))
        if moved is not None:
            return moved, (shifted_ns - first_ns) * 1e-9
    return None, None


def bumped(shift=(0.0, 0.0, 0.0), turn_deg=0.0, sensor="right", poses=POSES):
    T = poses[sensor].copy()
    T[:3, :3] = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix() @ T[:3, :3]
    T[:3, 3] += shift
    return {**poses, sensor: T}


@pytest.mark.parametrize("bump", [{"shift": (0.0, 0.02, 0.0)}, {"turn_deg": 1.0}])
def test_two_centimetres_or_one_degree_are_detected_within_5_s(bump):
    before = frames(duration_s=BEFORE_S, noise=0.01, seed=1)
    after = frames(duration_s=AFTER_S, noise=0.01, seed=2, poses=bumped(**bump))
    moved, delay_s = watch(before, after)
    assert moved is not None
    assert delay_s < 5.0
    assert moved.sensors == ("left", "right")
    assert moved.distance > 0.015


def test_of_three_sensors_the_one_that_moved_is_named():
    poses = {**POSES, "back": sensor_pose(5.0, 0.5, 1.1, 170.0)}
    before = frames(duration_s=BEFORE_S, noise=0.02, seed=1, poses=poses)
    after = frames(
        duration_s=AFTER_S, noise=0.02, poses=bumped((0.0, 0.04, 0.0), sensor="back", poses=poses)
    )
    moved, _ = watch(before, after, poses)
    assert moved.sensors == ("back",)
    assert "'back' has been moved" in str(moved)


def test_a_person_who_begins_to_walk_or_goes_elsewhere_is_not_a_moved_sensor():
    stand = frames(duration_s=BEFORE_S, noise=0.02, walks=False, moves=False)
    walk = frames(duration_s=60.0, noise=0.02, seed=3)
    assert watch(stand, walk) == (None, None)


def test_trackers_that_err_with_the_view_are_not_moved_sensors():
    rng = np.random.default_rng(5)
    offsets = rng.normal(0.0, 0.02, (15, 3))
    some = frames(duration_s=60.0, noise=0.02, seed=3)
    for frame in some:
        frame.samples["right"].positions[:] += offsets
    assert watch(some[:300], some[300:]) == (None, None)


def test_an_offset_that_comes_and_goes_is_not_a_moved_sensor():
    """As where the trackers err with the posture, which lasts for seconds."""
    rng = np.random.default_rng(2)
    some = frames(duration_s=90.0, noise=0.02, seed=3)
    offsets = np.repeat(rng.normal(0.0, 0.02, (30, 3)), len(some) // 30 + 1, axis=0)
    for frame, offset in zip(some, offsets, strict=False):
        frame.samples["right"].positions[:] += offset
    assert watch(some[:300], some[300:]) == (None, None)


def test_a_wrong_calibration_is_reported_too():
    watchdog = Watchdog(extrinsics_from_map(bumped((0.15, 0.0, 0.0))))
    noticed = [watchdog.add(frame) for frame in frames(duration_s=26.0, noise=0.01)]
    assert any(moved is not None for moved in noticed)
    assert watchdog.displacement["right"] == pytest.approx(0.15, abs=0.02)

    turned = Watchdog(extrinsics_from_map(bumped(turn_deg=90.0)))
    some = frames(duration_s=26.0, noise=0.01, walks=False)
    assert any(turned.add(frame) is not None for frame in some)


def watched(*parts):
    """A watchdog after some parts of a session, one after the other."""
    watchdog, next_ns = Watchdog(extrinsics_from_map(POSES)), 0
    for part in parts:
        offset_ns = next_ns - part[0].stamp_ns
        for frame in part:
            watchdog.add(replace(frame, stamp_ns=frame.stamp_ns + offset_ns))
        next_ns = part[-1].stamp_ns + offset_ns + 66_000_000
    return watchdog


def of_a_visitor(some):
    """The same frames with somebody else in the left view, who moves alike."""
    moved = [with_positions(f, "left", f.samples["left"].positions + [0.9, 0.0, 0.0]) for f in some]
    visitors = [replace(frame.samples["left"], person="visitor") for frame in moved]
    return [
        replace(frame, samples={**frame.samples, "left": visitor})
        for frame, visitor in zip(moved, visitors, strict=True)
    ]


def test_another_person_in_one_view_is_not_a_moved_sensor():
    before, during = (frames(duration_s=BEFORE_S, noise=0.02, seed=seed) for seed in (1, 2))
    assert watched(before, of_a_visitor(during)).moved is None


@pytest.mark.parametrize(("pause_s", "is_noticed"), [(0.066, True), (10.0, False)])
def test_a_small_difference_after_an_absence_may_be_another_persons(pause_s, is_noticed):
    before = frames(duration_s=BEFORE_S, noise=0.01, seed=1)
    after = frames(duration_s=AFTER_S, noise=0.01, seed=2, poses=bumped((0.0, 0.02, 0.0)))
    moved, _ = watch(before, after, pause_s=pause_s)
    assert (moved is not None) is is_noticed


def test_exchanged_names_of_sides_are_not_a_moved_sensor():
    before, during = (frames(duration_s=BEFORE_S, noise=0.02, seed=seed) for seed in (1, 2))
    swapped = [with_positions(f, "right", f.samples["right"].positions[SWAPPED]) for f in during]
    assert watched(before, swapped).moved is None


def test_a_sensor_that_is_carried_with_its_person_in_view_is_reported():
    before = frames(duration_s=BEFORE_S, noise=0.02, seed=1)
    after = frames(duration_s=AFTER_S, noise=0.02, poses=bumped((0.0, 0.9, 0.0)))
    assert watched(before, after).moved.distance == pytest.approx(0.9, abs=0.05)


def test_a_sensor_that_is_carried_and_gives_its_person_a_new_id_is_reported_half_a_minute_later():
    before = frames(duration_s=BEFORE_S, noise=0.02, seed=1)
    after = of_a_visitor(frames(duration_s=40.0, noise=0.02, seed=2))
    assert watched(before, after).moved.distance == pytest.approx(0.9, abs=0.05)


def test_the_report_of_a_moved_sensor_ends_when_the_views_agree_again():
    before = frames(duration_s=BEFORE_S, noise=0.01, seed=1)
    during = frames(duration_s=60.0, noise=0.01, seed=2, poses=bumped((0.0, 0.02, 0.0)))
    assert watched(before, during).moved is not None
    assert watched(before, during, frames(duration_s=8.0, noise=0.01, seed=3)).moved is None


@pytest.mark.parametrize(("shift_m", "is_noticed"), [(0.04, False), (0.2, True)])
def test_of_the_calibration_s_own_frames_only_a_large_step_counts(shift_m, is_noticed):
    before = frames(duration_s=BEFORE_S, noise=0.01, seed=1)
    poses = bumped((0.0, shift_m, 0.0))
    after = frames(duration_s=40.0, noise=0.01, seed=2, poses=poses)
    offset_ns = before[-1].stamp_ns - after[0].stamp_ns + 66_000_000
    after = [replace(frame, stamp_ns=frame.stamp_ns + offset_ns) for frame in after]
    watchdog = Watchdog(extrinsics_from_map(POSES))
    moved = watchdog.moved_in([*before, *after[:150]])
    assert (moved is not None) is is_noticed
    if moved is None:
        assert not any(map(watchdog.add, after[150:]))
