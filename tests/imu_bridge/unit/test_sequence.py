"""Lost, repeated and late frames of one node."""

import pytest

from imu_bridge.sequence import Arrival, SequenceTracker, signed


def follow(*frames: tuple[int, int]) -> tuple[list[Arrival], dict[str, int]]:
    tracker = SequenceTracker()
    return [tracker.classify(*frame) for frame in frames], tracker.counters.as_dict()


def test_consecutive_frames_lose_nothing():
    arrivals, counts = follow((5, 0), (6, 10_000), (7, 20_000))
    assert arrivals == [Arrival.NEXT] * 3
    assert counts == {"frames": 3, "lost": 0, "duplicates": 0, "late": 0, "restarts": 0}


def test_a_gap_counts_the_missing_numbers():
    _, counts = follow((5, 0), (9, 40_000))
    assert counts["lost"] == 3


def test_sequence_numbers_and_clock_wrap():
    arrivals, counts = follow((65535, 2**32 - 5_000), (0, 5_000), (2, 25_000))
    assert arrivals == [Arrival.NEXT] * 3
    assert counts["lost"] == 1
    assert counts["restarts"] == 0


def test_a_repeated_frame_is_a_duplicate():
    arrivals, counts = follow((5, 70), (5, 70), (6, 10_070))
    assert arrivals == [Arrival.NEXT, Arrival.DUPLICATE, Arrival.NEXT]
    assert counts["duplicates"] == 1
    assert counts["lost"] == 0


def test_a_late_frame_is_counted_and_does_not_move_the_tracker_back():
    arrivals, counts = follow((5, 50_000), (7, 70_000), (6, 60_000), (8, 80_000))
    assert arrivals == [Arrival.NEXT, Arrival.NEXT, Arrival.LATE, Arrival.NEXT]
    assert counts["late"] == 1
    assert counts["lost"] == 1


@pytest.mark.parametrize("last", [(40_000, 400_000_000), (1000, 10_000_000), (60_000, 700_000_000)])
def test_a_restarted_node_loses_nothing(last: tuple[int, int]):
    arrivals, counts = follow(last, (0, 500), (1, 10_500))
    assert arrivals == [Arrival.NEXT, Arrival.RESTART, Arrival.NEXT]
    assert counts["restarts"] == 1
    assert counts["lost"] == 0


@pytest.mark.parametrize(("difference", "expected"), [(1, 1), (-1, -1), (255, -1), (128, -128)])
def test_signed_takes_the_short_way(difference: int, expected: int):
    assert signed(difference, 256) == expected
