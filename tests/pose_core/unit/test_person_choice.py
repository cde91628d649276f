"""Whom to follow where one person is wanted (walking people, drawn)."""

import numpy as np
from crowd_of_people import frames_of, walker
from walking_person import POSES

from pose_core.people.person_choice import ChosenPerson
from pose_core.session.extrinsics import extrinsics_from_map
from pose_core.streams.samples import ImuBlock

NEAR, FAR = walker((2.0, 0.0), (0.0, 0.0)), walker((3.5, 0.8), (0.0, 0.0), scale=0.9, phase=2.0)


def chosen(rule, people, *, there=None, duration_s=3.0, imus=None):
    follower = ChosenPerson(rule, extrinsics_from_map(POSES))
    given = []
    for persons, truth in frames_of(people, duration_s, there=there):
        if imus is not None:
            follower.add_imus(imus(persons[0].stamp_ns))
        who = {id(one): i for one, i in zip(persons, truth, strict=True)}
        given += [who.get(id(one), -1) for one in follower.select(persons)]
    return [each for each in given if each >= 0]


def test_rule_first_chooses_the_first_person():
    def there(_, index, time_s):
        return index == 1 or time_s > 1.0

    assert set(chosen("first", [NEAR, FAR], there=there)) == {1}
    assert set(chosen("", [NEAR, FAR], there=there)) == {1}


def test_rule_nearest_chooses_the_person_nearest_to_the_first_sensor():
    def there(_, index, time_s):
        return index == 1 or time_s > 1.0

    given = chosen("nearest", [NEAR, FAR], there=there, duration_s=5.0)
    assert (given[0], given[-1]) == (1, 0)


def test_an_id_chooses_its_person():
    assert set(chosen("2", [NEAR, FAR])) == {1}
    assert chosen("7", [NEAR, FAR]) == []


def test_after_six_seconds_of_absence_another_person_is_chosen():
    def there(_, index, time_s):
        return time_s < 1.5 if index == 0 else time_s > 0.5

    given = chosen("first", [NEAR, FAR], there=there, duration_s=9.0)
    assert given[0] == 0
    assert given[-1] == 1


def test_rule_imus_chooses_the_person_whose_motion_matches_the_imus():
    """IMUs on the arms of the far one."""
    rng = np.random.default_rng(3)

    def imus(stamp_ns):
        time_s = (stamp_ns - 1_000_000_000) * 1e-9 + 2.0  # the far one's phase
        raised = 0.8 * (1.0 + np.sin(1.1 * time_s))
        half = 0.5 * raised
        orientation = np.array([[np.sin(half), 0.0, 0.0, np.cos(half)]])
        return ImuBlock(
            segments=("left_forearm",),
            imu=np.zeros(1, np.int64),
            stamps_ns=np.array([stamp_ns]),
            orientation=orientation + rng.normal(0.0, 0.002, (1, 4)),
            orientation_stddev=np.full((1, 3), 0.02),
            angular_velocity=np.zeros((1, 3)),
            linear_acceleration=np.full((1, 3), np.nan),
        )

    given = chosen("imus", [NEAR, FAR], duration_s=12.0, imus=imus)
    assert given
    assert set(given) == {1}
