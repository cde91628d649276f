"""Madgwick's filter on real recordings with optical truth (BROAD: Laidig et al. 2021)."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from imu_bridge.filters.gyro_bias import RestBiasEstimator
from imu_bridge.filters.madgwick import MadgwickFilter
from imu_bridge.parameters import ImuBridgeParameters

pytestmark = pytest.mark.data

SLOW, FAST = "03_undisturbed_slow_rotation_C", "07_undisturbed_fast_rotation_B"


def filtered(trials: list[dict]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Orientations over each trial, without and with the bias from rests; all at once."""
    count = len(trials)
    filter_ = MadgwickFilter(2 * count, ImuBridgeParameters().beta)
    bias = RestBiasEstimator(2 * count, ImuBridgeParameters().gyro_bias_window)
    dt = np.array([1.0 / float(trial["sampling_rate"]) for trial in trials])
    lengths = np.array([len(trial["imu_gyr"]) for trial in trials])
    estimates = [np.empty((length, 4)) for length in (*lengths, *lengths)]
    for k in range(lengths.max()):
        running = np.flatnonzero(k < lengths)
        rate, acceleration, field = (
            np.array([trials[i][name][k] for i in running])
            for name in ("imu_gyr", "imu_acc", "imu_mag")
        )
        bias.update(running + count, dt[running], rate, acceleration)
        index = np.concatenate([running, running + count])
        orientation = filter_.update(
            index,
            np.tile(dt[running], 2),
            np.tile(rate, (2, 1)) - bias.bias[index],
            np.tile(acceleration, (2, 1)),
            np.tile(field, (2, 1)),
        )
        for i, q in zip(index, orientation, strict=True):
            estimates[i][k] = q
    return estimates[:count], estimates[count:]


def rmse_deg(trial: dict, estimate: np.ndarray) -> dict[str, float]:
    """Total, inclination and heading error over the trial's motion."""
    truth = trial["opt_quat"][:, [1, 2, 3, 0]]
    judged = trial["movement"].astype(bool) & ~np.isnan(truth).any(axis=1)
    error = Rotation.from_quat(estimate[judged]) * Rotation.from_quat(truth[judged]).inv()
    x, y, z, w = error.as_quat().T
    angles = {
        "total": 2 * np.arctan2(np.sqrt(x * x + y * y + z * z), np.abs(w)),
        "inclination": 2 * np.arctan2(np.hypot(x, y), np.hypot(z, w)),
        "heading": 2 * np.arctan2(np.abs(z), np.abs(w)),
    }
    return {name: float(np.degrees(np.sqrt(np.mean(a * a)))) for name, a in angles.items()}


def test_slow_and_fast_rotation_are_followed_and_the_bias_from_rests_helps(shared_data: Path):
    trials = [
        loadmat(shared_data / "broad" / f"{name}.mat", squeeze_me=True) for name in (SLOW, FAST)
    ]

    plain, unbiased = filtered(trials)

    slow, fast = map(rmse_deg, trials, plain)
    assert slow["total"] < 3.0
    assert slow["inclination"] < 1.3
    assert slow["heading"] < 3.0
    assert fast["total"] < 6.0
    assert fast["inclination"] < 3.0
    assert fast["heading"] < 5.5
    slow_unbiased, fast_unbiased = map(rmse_deg, trials, unbiased)
    assert slow_unbiased["total"] < min(slow["total"], 2.5)
    assert fast_unbiased["total"] < min(fast["total"], 3.5)
