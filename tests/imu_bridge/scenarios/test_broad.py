"""The orientation filters on real recordings with optical truth (BROAD: Laidig et al. 2021)."""

from pathlib import Path

import pytest

from imu_bridge.parameters import ImuBridgeParameters
from pose_bench.imu_accuracy import KINDS, VARIANTS, Variant, read_broad, trial_errors

pytestmark = pytest.mark.data

SLOW, FAST = "03_undisturbed_slow_rotation_C", "07_undisturbed_fast_rotation_B"

AHRS_SLOW_DEG, AHRS_FAST_DEG = 2.487, 4.507
"""Total error of Madgwick's filter in `ahrs` 0.4.0 (gain 0.12, `updateMARG`) on the same samples,
begun with the orientation that the first sample gives."""
PUBLISHED_SLOW_DEG = 2.471
"""Total error of Madgwick's own code (gain 0.12): results file of github.com/dlaidig/broad."""


@pytest.fixture(scope="module")
def errors_of(shared_data: Path):
    trials = read_broad(shared_data / "broad")

    def run(variant: Variant) -> dict[str, dict[str, float]]:
        """Errors by trial and kind [deg]."""
        found = trial_errors(trials, variant, iter)
        return {
            trial.name: dict(zip(KINDS, each, strict=True))
            for trial, each in zip(trials, found, strict=True)
        }

    return run


def named(name: str) -> Variant:
    return next(variant for variant in VARIANTS if variant.name == name)


def test_the_default_filter_is_within_1_9_degrees_of_the_truth(errors_of):
    found = errors_of(Variant(name="default", parameters=ImuBridgeParameters()))
    assert found[SLOW]["total"] <= 1.9
    assert found[FAST]["total"] <= 1.9
    assert found[FAST]["inclination"] < 1.1


def test_without_a_magnetometer_the_heading_drifts_little(errors_of):
    found = errors_of(named("vqf, no magnetometer"))
    assert found[SLOW]["total"] < 1.5
    assert found[FAST]["total"] < 1.8


def test_madgwicks_filter_is_within_5_percent_of_reference_implementations(errors_of):
    found = errors_of(named("madgwick, the paper's"))
    assert found[SLOW]["total"] == pytest.approx(AHRS_SLOW_DEG, rel=0.05)
    assert found[SLOW]["total"] == pytest.approx(PUBLISHED_SLOW_DEG, rel=0.05)
    assert found[FAST]["total"] == pytest.approx(AHRS_FAST_DEG, rel=0.05)
