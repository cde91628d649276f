"""UI-PRMD's Vicon files: 39 Plug-in Gait markers.

Vakanski, Jun, Paul, Baker (2018), A Data Set of Human Body Movements for Physical Rehabilitation
Exercises, Data 3(1):2. A row of ``…_positions.txt`` is a frame at 100 Hz, without a header: the
markers of :data:`MARKERS` [mm], z up.

Joint centres follow from the markers as in :mod:`pose_io.references.markers`, and all angles are
computed from them, as for every other skeleton. The Vicon's own angles are not used: its hip
flexion is relative to the pelvis, here it is relative to the trunk, which bends further.
"""

from pathlib import Path

import numpy as np

from pose_io.recordings.formats.number_tables import read_numbers
from pose_io.references.markers import MarkerSeries, plain, skeleton_of_markers
from pose_io.references.reference import Reference, reference_of_skeleton

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


def read_uiprmd(path: Path) -> Reference:
    """Read a repetition's file of positions.

    Raises:
        InputError: If it is not such a file.
    """
    markers = read_numbers(path, COLUMNS, "39 markers × 3").reshape(-1, len(MARKERS), 3)
    positions = 0.001 * markers
    positions[np.all(markers == 0.0, axis=2)] = np.nan  # hidden marker
    skeleton = skeleton_of_markers(
        MarkerSeries(
            stamps_ns=np.rint(np.arange(len(markers)) * (1e9 / RATE)).astype(np.int64),
            positions={plain(label): positions[:, i] for i, label in enumerate(MARKERS)},
        ),
        str(path),
    )
    return reference_of_skeleton("Vicon (UI-PRMD)", skeleton)
