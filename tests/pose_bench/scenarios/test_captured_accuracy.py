"""Accuracy on captured people before simulated sensors is pinned."""

from dataclasses import replace

import pytest

from pose_bench.captured import METHODS, run_session
from pose_bench.captured_suite import captured_specs

CHOSEN = ("joint_kf", "default", "default+imus")
METHODS_TRIED = [method for method in METHODS if method.name in CHOSEN]
DURATION_S = 25.0


@pytest.fixture(scope="module", params=[0, 1], ids=["calm", "spinning"])
def scores(request):
    spec = captured_specs(None, judged=True, seed=11)[0]
    spec = replace(spec, spins=bool(request.param), duration_s=DURATION_S, delays_s=None)
    return request.param, {each.method: each for each in run_session(spec, METHODS_TRIED)}


def test_the_default_estimator_is_as_accurate_as_it_was(scores):
    spins, by_method = scores
    assert by_method["default"].rmse_deg < LIMITS_DEG[spins][0]
    assert by_method["default"].rmse_ratio < 0.6


def test_imus_make_it_better_and_it_is_as_accurate_with_them_as_it_was(scores):
    spins, by_method = scores
    assert by_method["default+imus"].rmse_deg < LIMITS_DEG[spins][1]
    assert by_method["default+imus"].rmse_deg < by_method["default"].rmse_deg


LIMITS_DEG = {0: (6.3, 5.1), 1: (7.5, 6.5)}
"""Some 6 % above what was measured, with spins 7.09 and 6.10; calm at most 5.95 and 4.79."""
