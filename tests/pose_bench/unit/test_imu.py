"""`./pose bench imu`: its errors, its reading of BROAD, its bad arguments."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from pose_bench.imu_accuracy import VARIANTS, errors, read_broad, trial_errors
from pose_bench.tools.bench import run
from pose_core.errors import InputError


def resting_trial(path: Path, samples: int = 50) -> None:
    savemat(
        path,
        {
            "imu_gyr": np.zeros((samples, 3)),
            "imu_acc": np.tile([0.0, 0.0, 9.81], (samples, 1)),
            "imu_mag": np.tile([0.0, 20.0, -40.0], (samples, 1)),
            "opt_quat": np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1)),
            "movement": np.ones(samples),
            "sampling_rate": 100.0,
        },
    )


def test_heading_and_inclination_errors_are_separated():
    truth = Rotation.random(20, random_state=1)
    error = Rotation.from_euler("z", 10, degrees=True) * Rotation.from_euler("x", 4, degrees=True)
    total, heading, inclination = errors((error * truth).as_quat(), truth.as_quat())
    assert heading == pytest.approx(10.0, abs=1e-6)
    assert inclination == pytest.approx(4.0, abs=1e-6)
    assert total == pytest.approx(np.degrees(error.magnitude()))


def test_a_constant_heading_offset_is_no_error_without_a_magnetometer():
    truth = Rotation.random(20, random_state=1)
    turned = Rotation.from_euler("z", 170, degrees=True) * truth
    total, *_ = errors(turned.as_quat(), truth.as_quat(), knows_heading=False)
    assert total == pytest.approx(0.0, abs=1e-5)


def test_a_resting_trial_has_no_error_with_any_filter(tmp_path: Path):
    resting_trial(tmp_path / "01_rest.mat")
    trials = read_broad(tmp_path)
    for variant in VARIANTS:
        ((total, *_),) = trial_errors(trials, variant, iter)
        assert total < 0.1, variant.name


def test_the_table_has_a_row_a_trial_and_the_published_figure(tmp_path: Path, capsys):
    resting_trial(tmp_path / "01_rest.mat")
    assert run(["imu", str(tmp_path), "--no-synthetic", "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert "01_rest" in printed
    assert "4.96" in printed
    assert "| 01_rest |" in (tmp_path / "out" / "imu_accuracy.md").read_text()


def test_a_folder_without_trials_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match=r"found no .mat file in .* give BROAD's folder"):
        read_broad(tmp_path)


def test_a_file_that_is_no_trial_is_refused(tmp_path: Path):
    (tmp_path / "01.mat").write_bytes(b"not MATLAB's" * 40)
    with pytest.raises(InputError, match="is not a trial of BROAD"):
        read_broad(tmp_path)
    savemat(tmp_path / "01.mat", {"imu_gyr": np.zeros((3, 3))})
    with pytest.raises(InputError, match="is not a trial of BROAD"):
        read_broad(tmp_path)


def test_an_empty_selection_is_refused():
    with pytest.raises(InputError, match="nothing to run"):
        run(["imu", "--no-synthetic"])
