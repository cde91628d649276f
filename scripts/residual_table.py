"""Creates the table of a real tracker's errors for :mod:`pose_sim.captured.residuals`.

``python scripts/residual_table.py UIPRMD_DIR FILE.npz``: for every repetition of UI-PRMD with a
Kinect and a Vicon file, the Kinect's joints minus the Vicon's joint centres, after the best time
shift and rigid transform of the repetition.
"""

import sys
from pathlib import Path

import numpy as np

from pose_bench.uiprmd import Repetition, read_repetitions
from pose_core.api import FloatArray, SkeletonSeries
from pose_core.errors import InputError
from pose_evaluation.scores import rigidly_aligned
from pose_evaluation.time_shift import estimate_time_shift
from pose_io.references.uiprmd import read_uiprmd
from pose_sim.captured.residuals import posture_axes, postures_of

RATE = 10.0  # [Hz] of the rows: faster errors are white noise
LARGEST = 0.4  # [m] larger differences are left out
UNIT = 0.001  # [m] of the file


def residuals_of(repetition: Repetition, vicon: SkeletonSeries) -> tuple[FloatArray, FloatArray]:
    """Postures and errors of a repetition, (n, 15, 3) [m] each, at :data:`RATE`."""
    kinect = repetition.view.series
    kinect = kinect.shifted(-estimate_time_shift(kinect, vicon))
    begin = max(int(kinect.stamps_ns[0]), int(vicon.stamps_ns[0]))
    end = min(int(kinect.stamps_ns[-1]), int(vicon.stamps_ns[-1]))
    stamps_ns = np.arange(begin, end, round(1e9 / RATE))
    seen, true = kinect.at(stamps_ns), vicon.at(stamps_ns)
    known = np.isfinite(seen).all(axis=(1, 2)) & np.isfinite(true).all(axis=(1, 2))
    seen, true = seen[known], true[known]
    if len(seen) < RATE:
        return np.empty((0, 15, 3)), np.empty((0, 15, 3))
    errors = (rigidly_aligned(seen, true) - true) @ posture_axes(true)
    return postures_of(true), np.clip(errors, -LARGEST, LARGEST)


def write_table(folder: Path, path: Path) -> None:
    """Read UI-PRMD and write the table.

    Raises:
        InputError: If the folder holds no repetition.
    """
    postures, residuals = [], []
    for repetition in read_repetitions(folder).used:
        file = folder / "Vicon" / "Positions" / f"{repetition.name}_positions.txt"
        compressed = file.with_name(file.name + ".gz")
        vicon = read_uiprmd(compressed if compressed.exists() else file).skeleton
        if vicon is None:
            raise InputError(f"{file} holds no joints")
        posture, residual = residuals_of(repetition, vicon)
        if len(posture):
            postures.append(posture)
            residuals.append(residual)
    ends = np.cumsum([len(each) for each in postures]) - 1
    as_units = [np.rint(np.concatenate(each) / UNIT) for each in (postures, residuals)]
    np.savez_compressed(
        path,
        rate=RATE,
        ends=ends.astype(np.int32),
        postures=as_units[0].astype(np.int16),
        residuals=as_units[1].astype(np.int16),
    )


if __name__ == "__main__":
    write_table(Path(sys.argv[1]), Path(sys.argv[2]))
