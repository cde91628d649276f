"""Delay of the joints in one view behind another."""

import numpy as np
import pytest
from moving_body import motion

from pose_calibration.clocks.joint_delays import LAG_SPREAD_S, estimate_delay


def views(delay_s, noise=0.0, lags=None):
    """A moving body twice, the second time later, at 30 Hz."""
    rng = np.random.default_rng(0)
    series = motion(rate=300.0, duration_s=20.0)
    stamps = np.arange(1.0, 18.0, 1.0 / 30.0)
    late = np.broadcast_to(delay_s if lags is None else delay_s + lags, 15)
    at = [
        series.at(np.round((stamps - lag) * 1e9).astype(np.int64))[:, j]
        for j, lag in enumerate(late)
    ]
    first = series.at(np.round(stamps * 1e9).astype(np.int64))
    second = np.stack(at, axis=1)
    return stamps, *(each + rng.normal(0.0, noise, each.shape) for each in (first, second))


@pytest.mark.parametrize("delay_s", [0.0, 0.004, -0.013])
def test_a_delay_of_parts_of_a_frame_is_found(delay_s):
    found = estimate_delay(*views(delay_s, noise=0.003))
    assert found.estimate_s == pytest.approx(delay_s, abs=0.002)
    assert found.stddev_s < 0.01


def test_joints_that_lag_differently_widen_the_deviation_not_the_mean():
    lags = np.random.default_rng(1).normal(0.0, LAG_SPREAD_S, 15)
    lags -= lags.mean()
    found = estimate_delay(*views(0.01, lags=lags))
    assert abs(found.estimate_s - 0.01) < 3.0 * found.stddev_s


def test_constant_offsets_between_the_views_are_no_delay():
    stamps, first, second = views(0.0)
    assert abs(estimate_delay(stamps, first, second + 0.05).estimate_s) < 1e-6


def test_a_view_without_joints_determines_no_delay():
    stamps, first, second = views(0.0)
    assert estimate_delay(stamps, first, np.full_like(second, np.nan)).stddev_s == np.inf
