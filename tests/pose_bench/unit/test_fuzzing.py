"""A short, seeded part of `./pose bench fuzz`, and the faults that it detects."""

import pytest

from pose_bench.fuzz_targets import targets
from pose_bench.fuzzing import Target, fuzz
from pose_core.errors import InputError

CASES = 60  # `./pose bench fuzz --cases` takes more


def test_no_reader_crashes_on_mutated_inputs():
    with targets() as every:
        outcomes = [fuzz(target, CASES, seed=7) for target in every]

    assert {o.name: list(o.crashes) for o in outcomes if o.crashes} == {}
    assert sum(outcome.cases for outcome in outcomes) == CASES * len(outcomes)


def test_every_target_accepts_what_it_begins_from():
    with targets() as every:
        for target in every:
            for seed in target.seeds:
                target.read(seed)


def read_fragile(data):
    if data[:1] == b"a" and data[1:2] == b"b":
        if data[2:3] == b"c":
            raise ZeroDivisionError("deep inside")
        raise InputError("an error for users is none")


def test_a_crash_behind_several_conditions_is_found_and_kept():
    outcome = fuzz(Target(name="fragile", read=read_fragile, seeds=(b"abx",)), 3000, seed=1)

    (what,) = outcome.crashes
    assert what.startswith("ZeroDivisionError in read_fragile")
    assert outcome.crashes[what].startswith(b"abc")
    assert outcome.refused > 0


def test_the_same_seed_gives_the_same_inputs():
    def recorded(seed):
        inputs = []
        fuzz(Target(name="any", read=inputs.append, seeds=(b"abc",)), 50, seed=seed)
        return inputs

    assert recorded(1) == recorded(1) != recorded(2)


@pytest.mark.parametrize("seed", range(3))
def test_inputs_stay_within_a_size(seed):
    longest = []
    big = Target(name="big", read=lambda d: longest.append(len(d)), seeds=(b"x" * 65_000,))
    fuzz(big, 100, seed=seed)

    assert max(longest) <= 65_536
