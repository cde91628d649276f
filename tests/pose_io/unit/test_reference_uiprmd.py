import numpy as np
import pytest

from pose_core.errors import InputError
from pose_io.references.uiprmd import MARKERS, read_uiprmd

PLACES = {  # [mm] of a standing person, x forward, z up; the right side mirrored
    "C7": (-80, 0, 1500),
    "T10": (-100, 0, 1250),
    "CLAV": (60, 0, 1430),
    "STRN": (90, 0, 1250),
    "LFHD": (80, 70, 1680),
    "LBHD": (-80, 70, 1680),
    "LSHO": (0, 180, 1480),
    "LELB": (0, 230, 1150),
    "LWRA": (30, 240, 900),
    "LWRB": (-30, 240, 900),
    "LASI": (90, 120, 1000),
    "LPSI": (-90, 50, 1010),
    "LTHI": (20, 170, 750),
    "LKNE": (0, 150, 500),
    "LTIB": (0, 150, 300),
    "LANK": (0, 130, 90),
    "LHEE": (-60, 90, 40),
    "LTOE": (140, 100, 40),
}


def write(folder, frames=4, places=PLACES):
    markers = np.zeros((frames, len(MARKERS), 3))
    for name, (x, y, z) in places.items():
        markers[:, MARKERS.index(name)] = (x, y, z)
        if name.startswith("L"):
            markers[:, MARKERS.index("R" + name[1:])] = (x, -y, z)
    path = folder / "m01_s01_e01_positions.txt"
    np.savetxt(path, markers.reshape(frames, -1), delimiter=",")
    return path


def test_every_angle_is_measured_on_the_joint_centres(tmp_path):
    bent = dict(PLACES, LTIB=(-100, 150, 450), LANK=(-410, 150, 500))

    standing = read_uiprmd(write(tmp_path))
    kneeling = read_uiprmd(write(tmp_path, places=bent))

    assert all(np.degrees(np.abs(angle)).max() < 15.0 for angle in standing.angles.angles.values())
    turned = (
        kneeling.angles.angles["left_knee_flexion"] - standing.angles.angles["left_knee_flexion"]
    )
    assert np.degrees(turned) == pytest.approx(85.0, abs=15.0)
    assert not standing.synthetic
    assert np.diff(standing.angles.stamps_ns).tolist() == [10_000_000] * 3


def test_a_marker_at_the_origin_is_hidden(tmp_path):
    path = write(tmp_path)
    numbers = np.loadtxt(path, delimiter=",").reshape(4, len(MARKERS), 3)
    numbers[2, MARKERS.index("LELB")] = 0.0
    np.savetxt(path, numbers.reshape(4, -1), delimiter=",")

    flexion = read_uiprmd(path).angles.angles["left_shoulder_flexion"]

    assert np.isnan(flexion).tolist() == [False, False, True, False]


def test_a_table_of_another_width_is_refused(tmp_path):
    path = tmp_path / "m01_positions.txt"
    path.write_text("1,2,3\n")

    with pytest.raises(InputError, match="has 3 columns, expected 117"):
        read_uiprmd(path)
