"""A tracker's delay from the delays of the links, of which those with swinging straps differ."""

import numpy as np
import pytest

from pose_bench.reference import default_tracker_errors
from pose_core.body.average_body import neutral_pose
from pose_core.body.model import load_body_model
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import shape_of
from pose_core.filter.constants import make_constants
from pose_core.filter.tracker_errors import combined_delay
from pose_core.filter.tuning import FilterTuning

MODEL = load_body_model("default")
KNOWN_S = 0.02
CONSTANTS = make_constants(
    SegmentTree(MODEL, shape_of(MODEL, neutral_pose())), FilterTuning(), KNOWN_S
).tracker_errors
SQUARED = {"upper_arm": 50.0, "forearm": 170.0, "thigh": 550.0, "shank": 1400.0}  # [m²/s²]
LEADS_S = {"upper_arm": 0.01, "forearm": 0.01, "thigh": 0.047, "shank": 0.02}  # [s]


def sums_of(delays_s):
    """The sums of IMUs on all limbs, with a delay of each kind of link."""
    sums = np.zeros((len(MODEL.links), 2))
    for link, name in enumerate(MODEL.link_names):
        kind = name.partition("_")[2]
        if kind in SQUARED:
            sums[link] = SQUARED[kind] * np.array([1.0, delays_s[kind]])
    return sums


def pooled(sums):
    squared, product = sums.sum(axis=0)
    prior = CONSTANTS.delay_prior
    return (product + prior * KNOWN_S) / (squared + prior)


def test_delays_that_agree_count_by_the_squared_speed():
    sums = sums_of({"upper_arm": 0.066, "forearm": 0.055, "thigh": 0.061, "shank": 0.059})
    delay_s, stddev_s = combined_delay(CONSTANTS, sums)
    assert delay_s == pytest.approx(pooled(sums), abs=1e-12)
    assert stddev_s < 0.005


def test_straps_that_swing_bias_the_delay_less_and_are_stated():
    """The straps' leads are those that a session of a walk had; the tracker is 60 ms late."""
    sums = sums_of({kind: 0.06 + lead_s for kind, lead_s in LEADS_S.items()})
    delay_s, stddev_s = combined_delay(CONSTANTS, sums)
    assert abs(delay_s - 0.06) < 0.75 * abs(pooled(sums) - 0.06)
    assert abs(delay_s - 0.06) < 2.0 * stddev_s < 0.05


def test_straps_that_lag_and_lead_alike_give_the_same_deviation():
    of_sign = [
        combined_delay(CONSTANTS, sums_of({k: 0.06 + sign * v for k, v in LEADS_S.items()}))[1]
        for sign in (1.0, -1.0)
    ]
    assert of_sign[0] == pytest.approx(of_sign[1])


def test_a_single_imu_and_none_are_combined_with_the_known_delay():
    sums = np.zeros((len(MODEL.links), 2))
    assert combined_delay(CONSTANTS, sums)[0] == pytest.approx(KNOWN_S)
    sums[4] = 30.0, 30.0 * 0.06
    assert combined_delay(CONSTANTS, sums)[0] == pytest.approx(0.05)


def test_the_compiled_combination_equals_the_reference():
    rng = np.random.default_rng(5)
    for _ in range(50):
        sums = rng.exponential(300.0, (len(MODEL.links), 2)) * (rng.random((11, 1)) < 0.7)
        sums[:, 1] = sums[:, 0] * rng.normal(0.06, rng.choice([0.002, 0.03]), len(sums))
        expected = default_tracker_errors.combined_delay(CONSTANTS, sums)
        assert combined_delay(CONSTANTS, sums)[0] == pytest.approx(expected, abs=1e-12)
