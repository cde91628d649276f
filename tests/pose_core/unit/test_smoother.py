"""The smoother does not use a prediction whose covariance has been bounded."""

from dataclasses import replace

import numpy as np
import pytest

from pose_core.filter.layout import make_layout
from pose_core.filter.motion import LARGEST_STDDEV
from pose_core.filter.smoother import FilterStep, smoothed
from pose_core.filter.state import start_state
from pose_core.filter.tuning import FilterTuning

LINKS, SLIDES = 3, 1
LAYOUT, TUNING = make_layout(LINKS, SLIDES), FilterTuning()


def state_at(x, rotation_stddev=0.15):
    tuning = replace(TUNING, start=replace(TUNING.start, rotation=rotation_stddev))
    rotations = np.tile(np.eye(3), (LINKS, 1, 1))
    return start_state(LAYOUT, 2, tuning, np.full(SLIDES, 1e-4), np.array([x, 0.0, 1.0]), rotations)


@pytest.mark.parametrize(
    ("stddev", "is_smoothed"), [(0.5, True), (LARGEST_STDDEV, False)], ids=["free", "at the bound"]
)
def test_a_bounded_prediction_ends_the_smoothing(stddev, is_smoothed):
    steps = [
        FilterStep(dt_s=0.0, predicted=None, updated=state_at(0.0)),
        FilterStep(dt_s=0.03, predicted=state_at(0.0, stddev), updated=state_at(0.1)),
    ]

    first, last = smoothed(steps, LAYOUT, TUNING.motion)

    assert last.pose.position[0] == pytest.approx(0.1)
    assert (first.pose.position[0] > 0.01) == is_smoothed
