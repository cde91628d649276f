"""Publishing starts with the first certain pose, at the latest some time after the first one."""

from types import SimpleNamespace

import numpy as np
import pytest

from pose_core.body.average_body import neutral_pose
from pose_core.body.model import load_body_model
from pose_core.body.shape import shape_of
from pose_core.estimators.default import DefaultEstimator
from pose_core.fusion.output import START_STDDEV, StateOutput

MODEL = load_body_model("default")
SHAPE = shape_of(MODEL, neutral_pose())
PERIOD_NS = 10_000_000


class Estimates:
    """The part of a block of estimates that decides on the start."""

    def __init__(self, stamps_ns, stddev):
        self.stamps_ns = stamps_ns
        self.position_stddev = np.repeat(stddev[:, None], MODEL.size, axis=1)

    def rows(self, index):
        return SimpleNamespace(stamps_ns=self.stamps_ns[index])


@pytest.fixture
def first_published_s(monkeypatch):
    def run(certain_from_s):
        output = StateOutput(MODEL, SHAPE, DefaultEstimator.VARIANCE_CALIBRATION)
        for begin in range(0, 500, 50):
            stamps_ns = np.arange(begin, begin + 50) * PERIOD_NS
            stddev = np.where(stamps_ns < certain_from_s * 1e9, 2.0, 0.5) * START_STDDEV
            monkeypatch.setattr(output, "_estimates", lambda b, s=stddev: Estimates(b.stamps_ns, s))
            published = output.estimates(SimpleNamespace(stamps_ns=stamps_ns))
            if published is not None:
                return published.stamps_ns[0] / 1e9
        return None

    return run


def test_poses_that_are_too_uncertain_at_the_start_are_not_published(first_published_s):
    assert first_published_s(certain_from_s=0.8) == pytest.approx(0.8)


def test_poses_that_stay_uncertain_are_published_after_two_seconds(first_published_s):
    assert first_published_s(certain_from_s=60.0) == pytest.approx(2.01)
