"""Streams of joint angles with one fault each."""

import numpy as np
import pytest

from pose_evaluation.stream_quality import AngleStream, measure_stream

RATE = 100.0  # [Hz]
PERIOD_NS = 10_000_000


def stream(change=None, arrival_ns=1_000_000, count=1000):
    """An angle that swings as its velocity says; ``change`` spoils arrays by name."""
    t = np.arange(count) / RATE
    arrays = {
        "stamps_ns": 10**18 + np.arange(count) * PERIOD_NS,
        "position": np.sin(t)[:, None],
        "velocity": np.cos(t)[:, None],
        "stddev": np.full((count, 1), 0.02),
    }
    if change is not None:
        change(arrays)
    arrivals_ns = arrays["stamps_ns"] + arrival_ns
    return AngleStream(arrivals_ns=arrivals_ns, limits=np.array([[-2.0, 2.0]]), **arrays)


def broken(change=None, **options):
    return measure_stream(stream(change, **options)).broken(RATE)


def step_by(angle):
    def change(arrays):
        arrays["position"][500:] += angle

    return change


def silence(seconds):
    def change(arrays):
        arrays["stamps_ns"][500:] += round(seconds * 1e9)

    return change


def set_to(name, row, value):
    def change(arrays):
        arrays[name][row] = value(arrays[name])

    return change


def test_an_angle_that_moves_as_its_velocity_says_meets_all_requirements():
    quality = measure_stream(stream())
    assert quality.broken(RATE) == ()
    assert quality.rate == pytest.approx(RATE)
    assert quality.start_chatter < 2.0


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (step_by(0.1), "steps"),
        (set_to("position", 500, lambda q: 2.1), "limits"),
        (set_to("stamps_ns", 500, lambda stamps: stamps[499]), "stamps"),
        (set_to("stamps_ns", 500, lambda stamps: stamps[499] - 1), "stamps"),
    ],
)
def test_one_bad_message_breaks_its_requirement(change, name):
    assert name in broken(change)


def test_a_step_within_three_deviations_is_none():
    assert broken(step_by(0.05)) == ()


def test_a_stamp_that_is_later_than_its_arrival_is_ahead():
    assert broken(arrival_ns=-1) == ("stamps",)


def test_a_rate_that_is_three_percent_off_is_broken():
    assert measure_stream(stream()).broken(1.03 * RATE) == ("rate",)


def test_a_silence_counts_neither_in_the_rate_nor_as_velocity():
    quality = measure_stream(stream(silence(3.0)))
    assert quality.broken(RATE) == ()
    assert quality.step_after_silence_deg < 1.0


def test_after_a_silence_the_whole_step_counts():
    def change(arrays):
        silence(3.0)(arrays)
        step_by(0.2)(arrays)

    assert broken(change) == ("step after silence",)


def test_chatter_after_a_silence_is_found():
    def change(arrays):
        silence(3.0)(arrays)
        arrays["position"][500:600] += 0.01 * np.random.default_rng(1).standard_normal((100, 1))

    assert measure_stream(stream(change)).start_chatter > 20.0
