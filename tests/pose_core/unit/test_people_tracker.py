"""Who is who, across sensors, crossings and absences (walking people, drawn)."""

from dataclasses import replace

import numpy as np
import pytest
from crowd_of_people import frames_of, numbers_of, walker
from walking_person import POSES

from pose_core.joints import JOINTS, OTHER_SIDE
from pose_core.people.person_track import Presence
from pose_core.people.track_manager import MAX_TENTATIVE
from pose_core.people.tracker import PeopleTracker
from pose_core.streams.clocks import Clock
from pose_core.streams.samples import ImuSample, block_of

TO_THE_LEFT = walker((2.5, -1.5), (0.0, 1.0))
TO_THE_RIGHT = walker((2.9, 1.5), (0.0, -1.0), scale=0.95, phase=1.5)


def standing(place, **options):
    return walker(place, (0.0, 0.0), **options)


def tracker():
    return PeopleTracker(POSES)


def test_a_single_person_is_tracked_from_the_first_frame():
    frames = frames_of([TO_THE_LEFT], 1.0)
    people = tracker()
    given = [people.add(persons) for persons, _ in frames]
    assert all(len(each) == 1 for each in given)
    assert {number for each in given for number, _ in each} == {1}


def test_a_person_who_starts_to_run_before_a_slow_camera_is_never_lost():
    def runner(time_s):
        return walker((2.5, -2.5 + 4.0 * max(0.0, time_s - 2.0)), (0.0, 0.0))(time_s)

    frames = frames_of([runner], 4.0, rate=10, there=lambda sensor, *_: sensor == "left")
    people = tracker()
    given = [people.add(persons) for persons, _ in frames]
    assert {number for each in given for number, _ in each} == {1}
    assert all(len(each) == 1 for each in given)


def test_a_known_person_who_starts_to_run_before_two_slow_cameras_is_never_lost():
    def runner(time_s):
        return walker((2.5, -2.5 + 3.0 * max(0.0, time_s - 6.0)), (0.0, 0.0))(time_s)

    people = tracker()
    given = [people.add(persons) for persons, _ in frames_of([runner], 8.0, rate=10)]
    assert {number for each in given for number, _ in each} == {1}
    assert all(len(each) == 1 for each in given)


def test_a_known_person_who_leaps_from_side_to_side_is_never_lost():
    def leaping(time_s):
        aside = 0.5 * np.sin(2.0 * np.pi * max(0.0, time_s - 3.0))  # [m] at most 3 m/s
        return walker((2.5, aside), (0.0, 0.0))(time_s)

    people = tracker()
    given = [people.add(persons) for persons, _ in frames_of([leaping], 12.0)]
    assert {number for each in given for number, _ in each} == {1}
    assert all(len(each) == 1 for each in given)


def test_a_person_whom_two_rough_views_see_half_a_metre_apart_is_one():
    def seen(sample):
        shift = [0.0, 0.0, 0.5 * (sample.sensor == "right")]
        return replace(sample, positions=sample.positions + shift)

    frames = [[seen(sample) for sample in persons] for persons, _ in frames_of([TO_THE_LEFT], 2.0)]
    people = tracker()
    people.place_sensors(POSES, {}, rough_m=0.18)
    given = [people.add(persons) for persons in frames]
    assert {number for each in given for number, _ in each} == {1}
    assert all(len(each) == 1 for each in given)


def test_two_people_who_cross_keep_their_identities_in_both_sensors():
    given = numbers_of(tracker(), frames_of([TO_THE_LEFT, TO_THE_RIGHT], 3.0))
    assert {len(numbers) for numbers in given.values()} == {1}
    assert given[0] != given[1]


def test_identities_survive_exchanged_sensor_ids_at_a_crossing():
    def ids(sensor, index, time_s):
        return str((index + (time_s > 1.5)) % 2)

    given = numbers_of(tracker(), frames_of([TO_THE_LEFT, TO_THE_RIGHT], 3.0, ids=ids))
    assert {len(numbers) for numbers in given.values()} == {1}


def test_sensor_ids_may_differ_between_sensors():
    def ids(sensor, index, _):
        return str(index if sensor == "left" else 1 - index)

    given = numbers_of(tracker(), frames_of([TO_THE_LEFT, TO_THE_RIGHT], 2.0, ids=ids))
    assert {len(numbers) for numbers in given.values()} == {1}


def test_a_person_who_returns_after_five_seconds_keeps_the_identity():
    def there(_, index, time_s):
        return index == 1 or not 2.0 < time_s < 7.0

    def ids(_, index, time_s):
        return str(index) if time_s < 4.0 else str(index + 10)

    people = [standing((2.2, -0.6)), standing((3.0, 0.7), scale=0.9)]
    given = numbers_of(tracker(), frames_of(people, 10.0, there=there, ids=ids))
    assert {len(numbers) for numbers in given.values()} == {1}


def raised_arm(stamp_ns):
    """A sample of an IMU on the left forearm of a walker of phase 0."""
    half = 0.4 * (1.0 + np.sin(1.1 * (stamp_ns - 1_000_000_000) * 1e-9))
    sample = ImuSample(
        stamp_ns=stamp_ns,
        segment="left_forearm",
        orientation=np.array([np.sin(half), 0.0, 0.0, np.cos(half)]),
        orientation_stddev=np.full(3, 0.02),
        angular_velocity=np.zeros(3),
        linear_acceleration=np.full(3, np.nan),
    )
    return block_of(sample)


@pytest.mark.parametrize(("phase", "is_same"), [(0.0, True), (1.5, False)])
def test_who_comes_back_with_the_imus_keeps_the_identity_with_other_bone_lengths(phase, is_same):
    """Whom they do not fit gets a new one, as without IMUs."""

    def at(time_s):
        now = {} if time_s < 12.0 else {"scale": 0.9, "phase": phase}
        return standing((2.5, 0.0), **now)(time_s)

    def ids(_sensor, _index, time_s):
        return "1" if time_s < 12.0 else "2"

    def there(_sensor, _index, time_s):
        return not 10.0 < time_s < 20.0

    people, numbers = tracker(), set()
    for persons, _ in frames_of([at], 30.0, ids=ids, there=there):
        people.add_imus(raised_arm(persons[0].stamp_ns))
        numbers |= {number for number, _ in people.add(persons)}
    assert (numbers == {1}) is is_same


def test_a_smaller_person_at_the_same_place_gets_a_new_identity():
    def there(_, index, time_s):
        return time_s < 3.0 if index == 0 else time_s > 4.0

    people = [standing((2.5, 0.0)), standing((2.5, 0.0), scale=0.8)]
    given = numbers_of(tracker(), frames_of(people, 9.0, there=there))
    assert given[1][-1] != given[0][0]


def test_a_short_track_beside_others_gets_no_identity():
    def there(_, index, time_s):
        return index == 0 or 1.0 < time_s < 1.2

    frames = frames_of([standing((2.5, 0.0)), standing((3.0, 1.0))], 3.0, there=there)
    people = tracker()
    assert 1 not in numbers_of(people, frames)
    assert people.counters["ghosts"] == 1


def test_somebody_new_is_held_until_their_size_is_measured():
    def there(sensor, index, time_s):
        return index == 0 or (1.0 < time_s < 1.8 and sensor == "left")

    frames = frames_of([standing((2.5, 0.0)), standing((3.0, 1.0))], 4.0, there=there)
    people = tracker()
    assert 1 not in numbers_of(people, frames)
    assert (people.counters["ghosts"], people.counters["appeared"]) == (1, 1)


def test_a_person_of_known_size_is_not_somebody_new_while_it_is_uncertain():
    def there(_, index, time_s):
        return index == 0 or not 3.0 < time_s < 11.0

    def ids(_, index, time_s):
        return str(index) if time_s < 4.0 else str(index + 10)

    people = [standing((2.2, -0.6)), standing((3.0, 0.7), scale=0.99)]
    given = numbers_of(tracker(), frames_of(people, 20.0, there=there, ids=ids))
    assert {len(numbers) for numbers in given.values()} == {1}


def test_an_overlapping_second_skeleton_is_a_duplicate():
    beside = standing((2.55, 0.05))
    people = tracker()
    given = numbers_of(people, frames_of([standing((2.5, 0.0)), beside], 3.0))
    assert len({number for numbers in given.values() for number in numbers}) == 1
    assert people.counters["duplicates"] > 0


def test_identities_are_independent_of_the_order_of_skeletons():
    frames = frames_of([TO_THE_LEFT, TO_THE_RIGHT], 2.0)
    turned = [(persons[::-1], truth[::-1]) for persons, truth in frames]
    given = numbers_of(tracker(), frames)
    also = numbers_of(tracker(), turned)
    assert [len(numbers) for numbers in given.values()] == [len(each) for each in also.values()]


def test_association_uses_the_sensors_clock_offsets():
    frames = [
        ([one if one.sensor == "left" else _later(one) for one in persons], truth)
        for persons, truth in frames_of([TO_THE_LEFT, TO_THE_RIGHT], 2.0)
    ]
    people = PeopleTracker(POSES, {"right": Clock(offset_ns=2_000_000_000)})
    assert {len(numbers) for numbers in numbers_of(people, frames).values()} == {1}


def test_a_left_right_swapped_skeleton_keeps_the_identity():
    people = tracker()
    frames = frames_of([TO_THE_LEFT, TO_THE_RIGHT], 2.0)
    mirrored = [
        ([_mirrored(one) if one.sensor == "right" else one for one in persons], truth)
        for persons, truth in frames
    ]
    assert {len(numbers) for numbers in numbers_of(people, mirrored).values()} == {1}


def test_people_are_recognised_after_a_recording_loops():
    frames = frames_of([standing((2.2, -0.6)), standing((3.0, 0.7), scale=0.9)], 4.0)
    people = tracker()
    first, again = numbers_of(people, frames), numbers_of(people, frames)
    assert first == again


def _later(sample):
    return type(sample)(**{**vars(sample), "stamp_ns": sample.stamp_ns + 2_000_000_000})


def _mirrored(sample):
    positions = np.ascontiguousarray(sample.positions[OTHER_SIDE])
    return type(sample)(**{**vars(sample), "positions": positions})


def test_in_a_crowd_a_tracked_person_stays_tracked_and_excess_skeletons_are_counted():
    people = tracker()
    numbers_of(people, frames_of([TO_THE_LEFT], 1.0))
    crowd = [standing((2.0 + 0.6 * (k % 6), 3.0 + 0.6 * (k // 6))) for k in range(20)]
    for persons, _ in frames_of([TO_THE_LEFT, *crowd], 2.0)[60:]:
        people.add(persons)
    assert people.counters["too_many"] > 0
    assert people.track(1).presence is Presence.PRESENT


def test_random_false_skeletons_create_few_tracks_and_displace_nobody():
    rng = np.random.default_rng(6)
    people, most, given = tracker(), 0, []
    for k, (persons, _) in enumerate(frames_of([TO_THE_LEFT], 3.0)):
        person = persons[0]
        strangers = [
            replace(person, person=f"s{n}", positions=person.positions + rng.uniform(1.0, 4.0, 3))
            for n in range(20 if k >= 60 else 0)
        ]
        given.append({number for number, _ in people.add([*strangers, person])})
        most = max(most, len(people.tracks))
    assert most <= MAX_TENTATIVE + 4
    assert all(1 in numbers for numbers in given)


def test_a_skeleton_without_joints_creates_no_track():
    people = tracker()
    frames = frames_of([TO_THE_LEFT], 2.0)
    nothing = np.full((len(JOINTS), 3), np.nan), np.zeros(len(JOINTS), np.uint8)
    for persons, _ in frames[:60]:
        people.add(persons)
    for persons, _ in frames[60:]:
        empty = [replace(one, positions=nothing[0], tracking_state=nothing[1]) for one in persons]
        assert people.add(empty) == []
    assert people.track(1).unseen_s(frames[-1][0][0].stamp_ns) > 0.5
