"""Captured people who cross, occlude each other, leave and return keep their identities."""

import pytest

from pose_bench.tools.people import make_scene, score_scene


@pytest.mark.parametrize("people", [2, 3, 4])
def test_no_person_is_confused_with_another(people):
    score, _ = score_scene(make_scene(people, 1, 30.0))
    assert (score.switches, score.wrong) == (0, 0)
    assert score.assigned > 0.98 * score.skeletons


@pytest.mark.parametrize("seed", [3, 8])
def test_six_persons_who_come_and_go_are_not_confused(seed):
    score, _ = score_scene(make_scene(6, seed, 60.0))
    assert (score.switches, score.wrong) == (0, 0)
    assert score.assigned > 0.8 * score.skeletons


def test_six_persons_who_stay_are_distinguished_once_their_size_is_known():
    score, _ = score_scene(make_scene(6, 0, 30.0))
    assert (score.switches, score.wrong) == (0, 0)
    assert score.assigned > 0.95 * score.skeletons
