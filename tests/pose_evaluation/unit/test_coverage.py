import numpy as np
import pytest

from pose_core.api import ANGLES, AngleSeries, EstimateSeries
from pose_evaluation.uncertainty import mean_coverage, uncertainty_coverage

COUNT = 2000
STAMPS_NS = 1_000_000_000 + 10_000_000 * np.arange(COUNT)


def reference(**angles):
    """A standing person whose named angles [rad] are given."""
    standing = {name: np.zeros(COUNT) for name in ANGLES}
    return AngleSeries(stamps_ns=STAMPS_NS, angles={**standing, **angles})


def estimates_of(true, error, stddev, shift_ns=0):
    """Published angles with an error and a standard deviation [rad], (n,) or constant."""
    position = np.stack([true.angles[name] for name in ANGLES], axis=1)
    position = position + np.reshape(error, (-1, 1))
    return EstimateSeries(
        stamps_ns=true.stamps_ns + shift_ns,
        names=ANGLES,
        position=position,
        position_stddev=np.zeros_like(position) + np.reshape(stddev, (-1, 1)),
        weight_kinect=np.ones_like(position),
        weight_imu=np.zeros_like(position),
        source=np.ones(position.shape, np.uint8),
        latency_s=np.full(COUNT, 0.02),
    )


def test_errors_of_published_angles_are_held_against_their_standard_deviations():
    true = reference(left_knee_flexion=np.linspace(0.0, 1.5, COUNT))
    for stddev, within in ((0.06, (0.0, 1.0)), (0.04, (0.0, 0.0)), (0.2, (1.0, 1.0))):
        found = mean_coverage(uncertainty_coverage(estimates_of(true, 0.1, stddev), true, 0.0))

        assert (found.within_1, found.within_2) == within
        assert found.mean_stddev_deg == pytest.approx(np.degrees(stddev))
        assert found.samples == len(ANGLES) * COUNT


def test_normal_errors_are_covered_as_they_should_be():
    rng = np.random.default_rng(3)
    stddev = rng.uniform(0.05, 0.5, COUNT)
    made = estimates_of(reference(), stddev * rng.standard_normal(COUNT), stddev)

    found = mean_coverage(uncertainty_coverage(made, reference(), 0.0))

    assert (found.within_1, found.within_2) == pytest.approx((0.683, 0.954), abs=0.03)


def test_the_methods_delay_is_removed():
    true = reference(right_knee_flexion=np.sin(np.arange(COUNT) / 10.0))
    late = estimates_of(true, 0.0, 0.01, shift_ns=50_000_000)

    knee = uncertainty_coverage(late, true, 0.05)["right_knee_flexion"]

    assert knee.within_1 == 1.0
    assert uncertainty_coverage(late, true, 0.0)["right_knee_flexion"].within_2 < 0.1


def test_unknown_standard_deviations_and_errors_do_not_count():
    error, stddev = np.zeros(COUNT), np.full(COUNT, 0.2)
    error[:500], stddev[1500:] = np.nan, np.nan

    found = uncertainty_coverage(estimates_of(reference(), error, stddev), reference(), 0.0)

    assert {each.samples for each in found.values()} == {1000}
    nothing = uncertainty_coverage(estimates_of(reference(), np.nan, 0.2), reference(), 0.0)
    assert nothing == {}
    assert np.isnan(mean_coverage(nothing).within_1)


def test_flexion_of_a_limb_that_points_sideways_is_left_out():
    abduction = np.linspace(0.0, np.pi / 2.0, COUNT)
    true = reference(left_shoulder_abduction=abduction)

    found = uncertainty_coverage(estimates_of(true, 0.1, 0.2), true, 0.0)

    beyond = int(np.sum(abduction > np.radians(60.0)))
    assert found["left_shoulder_flexion"].samples == COUNT - beyond
    assert found["left_shoulder_abduction"].samples == COUNT
