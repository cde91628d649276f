"""OpenSim's files: marker positions (.trc) and joint coordinates (.mot)."""

from collections.abc import Iterable

import numpy as np

from pose_core.joints import JOINTS
from pose_core.streams.samples import FloatArray
from pose_io.export.motion import BodyMotion
from pose_io.export.opensim_coordinates import OpenSimModel, R_opensim_map, coordinates

MM = 1000.0  # [mm/m]


def trc_text(motion: BodyMotion, rate: float, name: str) -> str:
    """The joints as markers [mm] in OpenSim's ground; unknown ones are left empty.

    Args:
        motion: At the constant rate.
        rate: [Hz]
        name: The file's name, which the format repeats inside.
    """
    count = len(motion)
    points = motion.joints @ R_opensim_map.T * MM
    axes = [f"{axis}{index}" for index in range(1, len(JOINTS) + 1) for axis in "XYZ"]
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    values = [f"{rate:g}", f"{rate:g}", count, len(JOINTS), "mm", f"{rate:g}", 1, count]
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{name}",
        "\t".join([*keys.split(), "OrigNumFrames"]),
        "\t".join(map(str, values)),
        "\t".join(["Frame#", "Time", *(f"{joint}\t\t" for joint in JOINTS)]),
        "\t".join(["", "", *axes]),
        "",
    ]
    rows = zip(motion.times_s, points.reshape(count, -1), strict=True)
    for number, (time_s, row) in enumerate(rows, start=1):
        cells = ("" if np.isnan(value) else f"{value:.4f}" for value in row)
        # OpenSim takes a last empty cell for none at all, unless a tab ends the row.
        lines.append("\t".join([str(number), f"{time_s:.6f}", *cells, ""]))
    return "\n".join(lines) + "\n"


def mot_text(motion: BodyMotion, model: OpenSimModel, name: str) -> str:
    """The joint angles [deg] and the pelvis' place [m], by OpenSim's names and signs.

    Args:
        motion: At a constant rate.
        model: The model whose conventions to follow.
        name: What OpenSim shows as the motion's name.
    """
    columns = {"time": motion.times_s, **coordinates(motion, model)}
    header = [
        name,
        "version=1",
        f"nRows={len(motion)}",
        f"nColumns={len(columns)}",
        "inDegrees=yes",
        "endheader",
        "\t".join(columns),
    ]
    rows = np.stack(list(columns.values()), axis=1)
    return "\n".join([*header, *_rows(rows)]) + "\n"


def _rows(values: FloatArray) -> Iterable[str]:
    return ("\t".join(f"{value:.6f}" for value in row) for row in values)
