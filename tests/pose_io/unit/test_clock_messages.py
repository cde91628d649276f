"""Clocks are read from ``clock_offsets``; those that nobody has set are refused."""

from types import SimpleNamespace

import pytest

from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_io.clock_messages import clock_of, read_clocks


def reference(header_s, time_ref_s, source="right"):
    def stamp(seconds):
        return SimpleNamespace(sec=seconds, nanosec=0)

    header = SimpleNamespace(stamp=stamp(header_s))
    return SimpleNamespace(header=header, time_ref=stamp(time_ref_s), source=source)


class Bag:
    path = "bag"

    def __init__(self, *messages):
        self._messages = messages

    def topics_of_type(self, _):
        return ["/clock_offsets"]

    def messages(self, _):
        return self._messages

    def deserialize(self, message):
        return message


def test_an_offset_of_hours_is_believed():
    assert clock_of(reference(1_000, 8_200)).offset_ns == 7_200 * NS_PER_S


def test_an_offset_of_years_is_refused_with_what_to_set():
    with pytest.raises(InputError, match=r"'right' is \+19676 days ahead .* use_sim_time alike"):
        clock_of(reference(60, 1_700_000_000))


def test_a_bags_implausible_clocks_are_left_out_with_a_warning():
    bag = Bag(reference(60, 1_700_000_000), reference(60, 61, "imus"))
    with pytest.warns(UserWarning, match="clock_offsets is not used: .* different epochs"):
        clocks = read_clocks(bag)
    assert {source: clock.offset_ns for source, clock in clocks.items()} == {"imus": NS_PER_S}
