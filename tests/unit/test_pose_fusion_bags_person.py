import numpy as np

from pose_core.streams.person_selection import PersonSelector
from pose_core.streams.samples import SkeletonSample

S = 1_000_000_000


def person(name, x, stamp_ns=0, sensor="left"):
    return SkeletonSample(
        stamp_ns=stamp_ns,
        sensor=sensor,
        person=name,
        positions=np.full((15, 3), float(x)),
        tracking_state=np.full(15, 2, np.uint8),
    )


def chosen(selector, *persons):
    sample = selector.select(persons)
    return None if sample is None else sample.person


def test_the_only_person_is_followed():
    assert chosen(PersonSelector(), person("7", 0.0)) == "7"


def test_the_first_seen_is_followed_while_the_sensor_keeps_their_id():
    selector = PersonSelector()
    assert chosen(selector, person("a", 0.0), person("b", 1.0)) == "a"
    # They cross: the id decides, not the place.
    assert chosen(selector, person("b", 0.0), person("a", 1.0)) == "a"


def test_under_a_new_id_the_nearest_is_followed():
    selector = PersonSelector()
    chosen(selector, person("a", 0.0), person("b", 1.0))
    assert chosen(selector, person("b", 1.0), person("c", 0.1)) == "c"
    assert selector.counters["person_changed"] == 1


def test_somebody_far_off_is_not_taken_for_the_person():
    selector = PersonSelector()
    chosen(selector, person("a", 0.0), person("b", 1.0))
    assert chosen(selector, person("b", 1.0, stamp_ns=S)) is None
    assert selector.counters["other_person"] == 2


def test_after_two_seconds_anybody_is_followed():
    selector = PersonSelector()
    chosen(selector, person("a", 0.0))
    assert chosen(selector, person("b", 3.0, stamp_ns=3 * S)) == "b"


def test_a_given_id_is_followed_and_nobody_else():
    selector = PersonSelector("b")
    assert chosen(selector, person("a", 0.0), person("b", 1.0)) == "b"
    assert chosen(selector, person("a", 1.0)) is None


def test_each_sensor_has_its_own_ids():
    selector = PersonSelector()
    chosen(selector, person("a", 0.0))
    assert chosen(selector, person("z", 9.0, sensor="right")) == "z"


def test_an_empty_frame_is_counted():
    selector = PersonSelector()
    assert chosen(selector) is None
    assert selector.counters["nobody_seen"] == 1


def test_a_person_without_any_joint_loses_nothing():
    selector = PersonSelector()
    chosen(selector, person("a", 0.0), person("b", 1.0))
    assert chosen(selector, person("a", np.nan), person("b", 1.0)) == "a"
    assert chosen(selector, person("c", 0.1), person("b", 1.0)) == "c"
