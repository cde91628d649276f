"""The line about times in which no camera saw the person."""

import numpy as np
import pytest

from pose_evaluation.unseen import unseen_line

BEGIN_NS = 1_764_000_000_000_000_000


def line_of(changes, end_s=20.0):
    """Line of estimates at 100 Hz whose sources change at some times; None: no estimates."""
    times_s = np.arange(1.0, 20.0, 0.01)
    sources = np.ones(len(times_s), np.uint8)
    exists = np.ones(len(times_s), bool)
    for from_s, to_s, source in changes:
        of_it = (times_s > from_s) & (times_s < to_s)
        exists[of_it] = source is not None
        sources[of_it] = source or 0
    stamps_ns = BEGIN_NS + np.rint(times_s * 1e9).astype(np.int64)
    end_ns = BEGIN_NS + round(end_s * 1e9)
    return unseen_line(stamps_ns[exists], sources[exists], BEGIN_NS, end_ns)


@pytest.mark.parametrize("changes", [(), [(4.0, 4.9, 0)], [(4.0, 4.9, None), (6.0, 6.9, 2)]])
def test_nothing_is_said_of_a_person_who_is_out_of_view_for_less_than_a_second(changes):
    assert not line_of(changes)


def test_it_names_the_longest_time_and_what_carried_the_pose():
    line = line_of([(4.0, 6.0, 2), (8.0, 12.2, 2)])
    assert line == (
        "no camera saw the person for 4.2 s from 8.0 s (and 1 more, 6.2 s in all): "
        "poses by the IMUs alone"
    )


def test_it_says_for_how_long_there_were_poses():
    line = line_of([(5.0, 6.0, 0), (6.0, 9.0, None)])
    assert line == (
        "no camera saw the person for 4.0 s from 5.0 s: poses by prediction for 1.0 s of it, "
        "then none"
    )


def test_the_end_of_the_recording_counts():
    line = line_of([(15.0, 20.0, None)])
    assert line == "no camera saw the person for 5.0 s from 15.0 s: no poses"


def test_a_late_first_pose_is_said():
    line = line_of([(0.0, 12.0, None), (15.0, 20.0, None)])
    assert line == (
        "the first pose is of 12.0 s; no camera saw the person for 5.0 s from 15.0 s: no poses"
    )


def test_estimates_that_never_rest_on_cameras_have_no_such_time_but_may_begin_late():
    assert not line_of([(0.0, 20.0, 2)])
    assert line_of([(0.0, 12.0, None), (12.0, 20.0, 2)]) == "the first pose is of 12.0 s"
