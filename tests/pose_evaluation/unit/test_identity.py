"""Evaluation of the tracking of identities."""

from pose_evaluation.identity import score_identities


def test_a_switch_is_counted_whenever_a_person_gets_another_identity():
    score = score_identities([("a", 1), ("b", 2), ("a", 1), ("a", 2), ("b", 1), ("a", 2)])
    assert (score.switches, score.wrong) == (2, 2)


def test_skeletons_without_an_identity_are_no_switch():
    score = score_identities([("a", None), ("a", 1), ("a", None), ("a", 1)])
    assert (score.switches, score.skeletons, score.assigned) == (0, 4, 2)


def test_scores_add_up():
    score = score_identities([("a", 1)]) + score_identities([("a", 1), ("a", 2)])
    assert (score.skeletons, score.switches) == (3, 1)
