r"""OpenSim's files: marker positions (.trc) and joint coordinates (.mot).

OpenSim's ground has x forward, y up, z to the right: :math:`p_{os} = (x, z, -y)` of a point in
``map``. Its ball joints rotate about z, then x, then y (intrinsic), in the same order as the joints
here: each angle is converted by itself, some with the opposite sign. Rajagopal2016 and gait2392
have the same names; gait2392's knee is negative when bent, and it has no arms.

References:
    Rajagopal et al. (2016), IEEE Trans. Biomed. Eng. 63(10), model Rajagopal2016.osim;
    Delp et al. (1990), IEEE Trans. Biomed. Eng. 37(8), model gait2392.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import unwrapped
from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS, SIDES
from pose_io.export.exporter import Exporter, ExportOptions
from pose_io.export.motion import BodyMotion

R_opensim_map = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotates vectors from ``map`` into OpenSim's ground frame."""

LIMBS = {  # joint angle: OpenSim's name, sign
    "hip_flexion": ("hip_flexion", 1.0),
    "hip_abduction": ("hip_adduction", -1.0),
    "hip_rotation": ("hip_rotation", 1.0),
    "knee_flexion": ("knee_angle", 1.0),
    "shoulder_flexion": ("arm_flex", 1.0),
    "shoulder_abduction": ("arm_add", -1.0),
    "shoulder_rotation": ("arm_rot", 1.0),
    "elbow_flexion": ("elbow_flex", 1.0),
}
WAIST = {
    "waist_flexion": ("lumbar_extension", -1.0),
    "waist_lateral_bending": ("lumbar_bending", 1.0),
    "waist_rotation": ("lumbar_rotation", 1.0),
}
PELVIS = ("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz")


@dataclass(frozen=True, kw_only=True)
class OpenSimModel:
    """Parameters in which OpenSim's models differ."""

    hips_in_pelvis: tuple[float, float, float]  # [m] midway between the hips, in its pelvis' axes
    knee_sign: float = 1.0  # of a bent knee


OPENSIM_MODELS: Mapping[str, OpenSimModel] = {
    "rajagopal2016": OpenSimModel(hips_in_pelvis=(-0.056276, -0.078490, 0.0)),
    "gait2392": OpenSimModel(hips_in_pelvis=(-0.0707, -0.0661, 0.0), knee_sign=-1.0),
}


def coordinate_map(model: OpenSimModel) -> dict[str, tuple[str, float]]:
    """OpenSim's name and sign of each joint angle that the model has."""
    names = dict(WAIST)
    for side in SIDES:
        for ours, (theirs, sign) in LIMBS.items():
            knee = model.knee_sign if theirs == "knee_angle" else 1.0
            names[f"{side}_{ours}"] = (f"{theirs}_{side[0]}", sign * knee)
    return names


def coordinates(motion: BodyMotion, model: OpenSimModel) -> dict[str, FloatArray]:
    """Every coordinate by OpenSim's name, in [deg] or [m], shape (n,) each.

    Joint angles that OpenSim's models lack (the neck's) keep their names and signs.
    """
    columns = _pelvis(motion, model)
    names = coordinate_map(model)
    for name in motion.model.angle_names:
        theirs, sign = names.get(name, (name, 1.0))
        columns[theirs] = sign * np.degrees(motion.dof[:, motion.model.dof_index[name]])
    return columns


def _pelvis(motion: BodyMotion, model: OpenSimModel) -> dict[str, FloatArray]:
    """Tilt about z, list about x, rotation about y; position of the model's pelvis."""
    R_map_body = Rotation.from_rotvec(motion.dof[:, 3:6]).as_matrix()
    R_ground_pelvis = R_opensim_map @ R_map_body @ R_opensim_map.T
    tilt, list_, rotation = Rotation.from_matrix(R_ground_pelvis).as_euler("ZXY").T
    hips = motion.dof[:, :3] @ R_opensim_map.T
    origin = hips - R_ground_pelvis @ np.array(model.hips_in_pelvis)
    # Only turns of the person are counted: tilt would not come back from one near the lock.
    values = [*np.degrees([tilt, list_, unwrapped(rotation)]), *origin.T]
    return dict(zip(PELVIS, values, strict=True))


MM = 1000.0  # [mm/m]


def trc_text(motion: BodyMotion, rate: float, name: str) -> str:
    """The joints as markers [mm] in OpenSim's ground; unknown ones are left empty.

    Args:
        motion: A motion at the constant rate.
        rate: The rate [Hz].
        name: The file's name, which the format's header contains.
    """
    points_mm = motion.joints @ R_opensim_map.T * MM
    return trc_of_points(motion.times_s, points_mm, rate, name)


def trc_of_points(times_s: FloatArray, points_mm: FloatArray, rate: float, name: str) -> str:
    """The 15 joints at n instants [s] as markers, (n, 15, 3) [mm]; NaN is left empty."""
    count = len(times_s)
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
    rows = zip(times_s, points_mm.reshape(count, -1), strict=True)
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
    size = f"nRows={len(motion)}\nnColumns={len(columns)}"
    header = f"{name}\nversion=1\n{size}\ninDegrees=yes\nendheader"
    rows = zip(*columns.values(), strict=True)
    lines = ["\t".join(f"{value:.6f}" for value in row) for row in rows]
    return "\n".join([header, "\t".join(columns), *lines]) + "\n"


def _mot(motion: BodyMotion, options: ExportOptions) -> bytes:
    model = OPENSIM_MODELS[options.opensim_model]
    return mot_text(motion, model, Path(options.file_name).stem).encode()


TRC = Exporter(
    doc="joints as markers, for OpenSim",
    content=lambda motion, options: trc_text(motion, options.rate, options.file_name).encode(),
)
MOT = Exporter(
    doc="joint angles with OpenSim's names and signs",
    content=_mot,
    fills_gaps=True,
    unknown_angles="they are interpolated",
)
