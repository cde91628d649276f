"""OpenSim's files: marker positions (.trc) and joint coordinates (.mot)."""

from pathlib import Path

import numpy as np

from pose_core.joints import JOINTS
from pose_io.export.exporter import Exporter, ExportOptions
from pose_io.export.motion import BodyMotion
from pose_io.export.opensim_coordinates import (
    OPENSIM_MODELS,
    OpenSimModel,
    R_opensim_map,
    coordinates,
)

MM = 1000.0  # [mm/m]


def trc_text(motion: BodyMotion, rate: float, name: str) -> str:
    """The joints as markers [mm] in OpenSim's ground; unknown ones are left empty.

    Args:
        motion: A motion at the constant rate.
        rate: The rate [Hz].
        name: The file's name, which the format's header contains.
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
        # OpenSim ignores an empty last cell unless the row ends with a tab.
        lines.append("\t".join([str(number), f"{time_s:.6f}", *cells, ""]))
    return "\n".join(lines) + "\n"


def mot_text(motion: BodyMotion, model: OpenSimModel, name: str) -> str:
    """The joint angles [deg] and the pelvis' position [m], with OpenSim's names and signs.

    Args:
        motion: At a constant rate.
        model: The model whose conventions are used.
        name: The motion's name in OpenSim.
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
    rows = zip(*columns.values(), strict=True)
    lines = ["\t".join(f"{value:.6f}" for value in row) for row in rows]
    return "\n".join([*header, *lines]) + "\n"


def _mot(motion: BodyMotion, options: ExportOptions) -> bytes:
    model = OPENSIM_MODELS[options.opensim_model]
    return mot_text(motion, model, Path(options.file_name).stem).encode()


TRC = Exporter(
    doc="joints as markers, for OpenSim",
    content=lambda motion, options: trc_text(motion, options.rate, options.file_name).encode(),
)
MOT = Exporter(doc="joint angles with OpenSim's names and signs", content=_mot, fills_gaps=True)
