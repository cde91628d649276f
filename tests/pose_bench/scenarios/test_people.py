"""Captured people who cross, occlude each other, leave and return keep their identities."""

import pytest

from pose_bench.tools.people import make_scene, score_scene


@pytest.mark.parametrize("people", [2, 3, 4])
def test_no_person_is_confused_with_another(people):
    score = score_scene(make_scene(people, 1, 30.0)).identity
    assert (score.switches, score.wrong, score.identities) == (0, 0, people)
    assert score.assigned > 0.98 * score.skeletons


def test_six_persons_are_distinguished_once_their_size_is_known():
    score = score_scene(make_scene(6, 0, 30.0)).identity
    assert score.switches <= 1
    assert score.wrong < 0.01 * score.assigned
    assert score.assigned > 0.95 * score.skeletons
