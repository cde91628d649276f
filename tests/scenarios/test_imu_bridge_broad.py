"""Madgwick's filter on real recordings with optical truth (BROAD: Laidig et al. 2021)."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

from imu_bridge.madgwick import MadgwickFilter
from imu_bridge.parameters import ImuBridgeParameters

pytestmark = pytest.mark.data

BETA = ImuBridgeParameters().beta


def rmse_deg(path: Path, beta: float) -> dict[str, float]:
    """Total, inclination and heading error over the trial's motion."""
    trial = loadmat(path, squeeze_me=True)
    filter_ = MadgwickFilter(1, beta)
    index, dt = np.array([0]), np.array([1.0 / float(trial["sampling_rate"])])
    samples = zip(
        *(trial[name][:, None, :] for name in ("imu_gyr", "imu_acc", "imu_mag")), strict=True
    )
    estimate = np.array([filter_.update(index, dt, *sample)[0] for sample in samples])

    truth = trial["opt_quat"][:, [1, 2, 3, 0]]
    judged = trial["movement"].astype(bool) & ~np.isnan(truth).any(axis=1)
    error = (
        Rotation.from_quat(estimate[judged]) * Rotation.from_quat(truth[judged]).inv()
    ).as_quat()
    x, y, z, w = error.T
    angles = {
        "total": 2 * np.arctan2(np.sqrt(x * x + y * y + z * z), np.abs(w)),
        "inclination": 2 * np.arctan2(np.hypot(x, y), np.hypot(z, w)),
        "heading": 2 * np.arctan2(np.abs(z), np.abs(w)),
    }
    return {name: float(np.degrees(np.sqrt(np.mean(a * a)))) for name, a in angles.items()}


def test_slow_rotation_is_followed(shared_data: Path):
    errors = rmse_deg(shared_data / "broad" / "03_undisturbed_slow_rotation_C.mat", BETA)
    assert errors["total"] < 3.0
    assert errors["inclination"] < 1.3
    assert errors["heading"] < 3.0


def test_fast_rotation_is_followed(shared_data: Path):
    errors = rmse_deg(shared_data / "broad" / "07_undisturbed_fast_rotation_B.mat", BETA)
    assert errors["total"] < 6.0
    assert errors["inclination"] < 3.0
    assert errors["heading"] < 5.5
