"""Joint centres from real Vicon markers, compared with Plug-in Gait's angles."""

import gzip

import numpy as np
import pytest

from pose_core.body.joint_angles import joint_angles
from pose_io.references.markers import MarkerSeries, plain, skeleton_of_markers
from pose_io.references.uiprmd import MARKERS

PLUG_IN_GAIT = {"left_knee_flexion": 57, "right_knee_flexion": 60}  # columns, from 0

pytestmark = pytest.mark.data


def table(path):
    with gzip.open(path, "rt") as lines:
        return np.loadtxt(lines, delimiter=",")


@pytest.mark.parametrize("trial", ["m01_s01_e02", "m03_s01_e02", "m05_s02_e02"])
def test_knee_angles_agree_with_plug_in_gait(trial, shared_data):
    folder = shared_data / "uiprmd" / "Vicon"
    points = table(folder / "Positions" / f"{trial}_positions.txt.gz") / 1000.0
    points = points.reshape(len(points), len(MARKERS), 3)
    markers = MarkerSeries(
        stamps_ns=np.arange(len(points)) * 10_000_000,
        positions={plain(label): points[:, index] for index, label in enumerate(MARKERS)},
    )
    found = joint_angles(skeleton_of_markers(markers, trial).positions)
    expected = table(folder / "Angles" / f"{trial}_angles.txt.gz")
    for name, column in PLUG_IN_GAIT.items():
        error = np.degrees(found[name]) - expected[:, column]
        assert np.sqrt(np.mean(error**2)) < 3.5
