"""UI-PRMD's Vicon files: 39 Plug-in Gait markers and the joint angles of the Vicon's own software.

Vakanski, Jun, Paul, Baker (2018), A Data Set of Human Body Movements for Physical Rehabilitation
Exercises, Data 3(1):2. A row is a frame at 100 Hz, without a header: ``…_positions.txt`` holds the
markers of :data:`MARKERS` [mm], z up; ``…_angles.txt`` 39 × 3 angles [deg].

Joint centres follow from the markers as in :mod:`pose_fusion.evaluation.references.markers`. Knee
and hip flexion are the Vicon's own columns (:data:`OWN_FLEXION`); the other angles are measured on
the joint centres.
"""

import zlib
from pathlib import Path

import numpy as np

from pose_common.errors import InputError
from pose_fusion.evaluation.angle_series import AngleSeries, angle_series
from pose_fusion.evaluation.references.markers import MarkerSeries, plain, skeleton_of_markers
from pose_fusion.evaluation.references.reference import Reference
from pose_fusion.streams.samples import FloatArray

RATE = 100.0  # [Hz]
MARKERS = (
    *("LFHD", "RFHD", "LBHD", "RBHD", "C7", "T10", "CLAV", "STRN", "RBAK"),
    *("LSHO", "LUPA", "LELB", "LFRM", "LWRA", "LWRB", "LFIN"),
    *("RSHO", "RUPA", "RELB", "RFRM", "RWRA", "RWRB", "RFIN"),
    *("LASI", "RASI", "LPSI", "RPSI"),
    *("LTHI", "LKNE", "LTIB", "LANK", "LHEE", "LTOE"),
    *("RTHI", "RKNE", "RTIB", "RANK", "RHEE", "RTOE"),
)
"""The markers in the files' order."""
COLUMNS = 3 * len(MARKERS)
OWN_FLEXION = {
    "left_knee_flexion": 57,
    "right_knee_flexion": 60,
    "left_hip_flexion": 45,
    "right_hip_flexion": 48,
}
"""The columns, from 0, of the Vicon's own angles."""
POSITIONS, ANGLES = "positions", "angles"  # how folders and files are named


def read_uiprmd(path: Path) -> Reference:
    """Read a repetition: a file of positions and the angles that belong to it.

    Raises:
        InputError: If one of them is missing or not what it should be.
    """
    markers = _read_numbers(path).reshape(-1, len(MARKERS), 3)
    own = _read_numbers(_angles_path(path))
    if len(markers) != len(own):
        raise InputError(
            f"{path} has {len(markers)} frames, {_angles_path(path)} {len(own)}: "
            "expected two files of one repetition"
        )
    positions = 0.001 * markers
    positions[np.all(markers == 0.0, axis=2)] = np.nan  # not seen
    skeleton = skeleton_of_markers(
        MarkerSeries(
            stamps_ns=np.rint(np.arange(len(markers)) * (1e9 / RATE)).astype(np.int64),
            positions={plain(label): positions[:, i] for i, label in enumerate(MARKERS)},
        ),
        str(path),
    )
    angles = dict(angle_series(skeleton).angles)
    angles |= {name: np.radians(own[:, column]) for name, column in OWN_FLEXION.items()}
    return Reference(
        name="Vicon (UI-PRMD)",
        synthetic=False,
        angles=AngleSeries(stamps_ns=skeleton.stamps_ns, angles=angles),
        skeleton=skeleton,
        notes=("knee and hip flexion are the Vicon's own, the rest is measured on joint centres",),
    )


def _angles_path(path: Path) -> Path:
    if POSITIONS not in path.name:
        raise InputError(
            f"{path} is not named …_{POSITIONS}.txt: name UI-PRMD's file of positions, the angles "
            "are found beside it"
        )
    folder = path.parent
    if folder.name == POSITIONS.title():
        folder = folder.with_name(ANGLES.title())
    return folder / path.name.replace(POSITIONS, ANGLES)


def _read_numbers(path: Path) -> FloatArray:
    if not path.is_file():
        raise InputError(f"found no file {path}: a repetition has positions and angles")
    try:
        numbers = np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, EOFError, ValueError, zlib.error) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{path} is no table of numbers: {reason}") from error
    if numbers.size == 0 or numbers.shape[1] != COLUMNS:
        raise InputError(
            f"{path} has {numbers.shape[1] if numbers.size else 0} columns, expected {COLUMNS}: "
            "39 markers or angles × 3"
        )
    return numbers.astype(np.float64)
