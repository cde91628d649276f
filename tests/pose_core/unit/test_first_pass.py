"""What a first pass over a recording gives to the second."""

from dataclasses import dataclass, field

import pytest
from synthetic_body import extrinsics
from worn_imus import merged, moving_wearer

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.offline import first_pass, run_first_pass, with_measured_delay

SENSORS = ("left", "right")
PARAMETERS = PipelineParameters(sensors=SENSORS)


@dataclass
class Measured:
    """A pipeline that has measured these delays."""

    tracker_delays_s: dict[str, tuple[float, float]] = field(default_factory=dict)


@pytest.mark.parametrize(
    ("given_s", "measured_s", "expected_s"),
    [
        pytest.param(0.0, {"left": (0.06, 0.01), "right": (0.03, 0.02)}, 0.054, id="weighted"),
        pytest.param(0.02, {"left": (0.06, 0.01)}, 0.02, id="given"),
        pytest.param(0.0, {"left": (-0.05, 0.01)}, 0.0, id="early"),
        pytest.param(0.0, {}, 0.0, id="none"),
    ],
)
def test_the_second_pass_expects_the_measured_delay(given_s, measured_s, expected_s):
    parameters = PipelineParameters(sensors=SENSORS, tracker_delay=given_s)
    found = with_measured_delay(parameters, Measured(measured_s))
    assert found.tracker_delay == pytest.approx(expected_s)


def test_the_alignments_of_moving_imus_are_found_for_the_beginning():
    _, _, skeletons, imus = moving_wearer(20.0)
    _, found = run_first_pass(merged(skeletons, imus), extrinsics(), PARAMETERS)
    assert set(found) == {sample.segment for sample in imus}


@pytest.mark.parametrize("estimator", ["imu", "zhang2015", "joint_kf"])
def test_other_estimators_need_a_single_pass(estimator):
    assert first_pass(PipelineParameters(sensors=SENSORS, estimator=estimator)) is None


def test_without_samples_of_imus_there_is_no_first_pass():
    _, _, skeletons, _ = moving_wearer(2.0)
    assert run_first_pass(merged(skeletons), extrinsics(), PARAMETERS) == (PARAMETERS, {})
