"""The YAML file of a calibration.

.. code-block:: yaml

    version: 3
    reference: left
    map:  # T_map_reference: the reference sensor in the world, z up, floor at z = 0
      translation: [0.0, 0.0, 1.21]  # [m]
      rotation: [-0.53, 0.53, -0.47, 0.47]  # quaternion x, y, z, w
      source: upright body and feet
    sensors:
      right:  # T_reference_sensor
        translation: [1.52, -0.04, 0.61]
        rotation: [0.01, -0.38, 0.02, 0.92]
        residuals: {frames: 1843, median: 0.032, ...}
    clocks:  # offset of each source's clock ahead of the reference's, at its own stamp at_ns
      right: {offset_ns: 21500000, drift_ppm: 0.0, at_ns: 1700000012345678900, stddev_ms: 2.1}
    view_offsets:  # [m] systematic offsets of trackers' joints, in the body's axes
      left: {head: [0.004, -0.002, 0.011], ...}
    body: {...}  # the person's measures, see body_section
    imus: {...}  # sensor-to-segment alignments, see :mod:`pose_calibration.imus.section`

``residuals``, ``view_offsets`` and the map's ``source`` are for information: a file written by
hand may omit them.
"""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from pose_calibration.files.body_section import body_document, read_body
from pose_calibration.files.clocks_section import clocks_document, read_clocks
from pose_calibration.files.file_values import (
    quaternion_values,
    read_mapping,
    read_rotation,
    read_vector,
    rounded,
    rounded_list,
)
from pose_core.api import BoardResiduals, Extrinsics, FloatArray, PairResiduals, rigid_transform
from pose_core.atomic_file import write_atomically
from pose_core.errors import InputError
from pose_core.joints import JOINTS
from pose_core.plain_yaml import dump_yaml, read_yaml

VERSION = 3
READABLE = (1, 2, 3)  # 1 had no view offsets and no sections, 2 offsets but no clocks
OWN_KEYS = ("version", "reference", "date", "map", "sensors", "clocks", "view_offsets")
"""Keys of the extrinsics themselves; ``date`` is in older files only."""
SECTIONS = ("body", "imus")  # written by other modules; there may be more
ALIKE = 0.8  # [-] similarity (difflib) to a known key above which a key is a typing error
METRE_DIGITS = 6
QUATERNION_DIGITS = 9


def save_extrinsics(path: Path, extrinsics: Extrinsics) -> None:
    """Write a calibration atomically; the same one always gives the same bytes.

    Other sections of a file that is replaced are kept.

    Args:
        path: The file; one that exists is replaced.
        extrinsics: The calibration.

    Raises:
        InputError: If it cannot be written.
    """
    sections = _sections_of(path)
    if extrinsics.body is not None:
        sections["body"] = body_document(extrinsics.body)
    write_document(path, {**_document(extrinsics), **sections})


def write_document(path: Path, document: Mapping[str, Any]) -> None:
    """Write a session's document atomically.

    Raises:
        InputError: If it cannot be written.
    """
    text = "# Poses of the sensors. Lengths in m, quaternions as x, y, z, w.\n"
    text += dump_yaml(dict(document), default_flow_style=None, width=100)
    write_atomically(path, text.encode(), "the calibration")


def read_document(path: Path) -> Mapping[Any, Any]:
    """Read a session's document: a mapping of a supported version.

    Raises:
        InputError: If the file is missing or not such a file.
    """
    document = read_yaml(path, "the calibration")
    if not isinstance(document, Mapping):
        raise InputError(f"{path} holds no calibration: expected 'version', 'reference', 'sensors'")
    if document.get("version") not in READABLE:
        raise InputError(
            f"{path} has version {document.get('version')!r}, expected "
            f"{' or '.join(map(str, READABLE))}: calibrate again"
        )
    return document


def _sections_of(path: Path) -> dict[str, Any]:
    """Other sections of a file whose extrinsics are about to be replaced."""
    if not path.exists():
        return {}
    try:
        document = read_document(path)
    except InputError:
        return {}  # the old file is not a session: it is replaced
    return {str(key): value for key, value in document.items() if key not in OWN_KEYS}


def load_extrinsics(path: Path) -> Extrinsics:
    """Read a calibration; residuals, the floor's report and offsets are not read back.

    Raises:
        InputError: If the file is missing or not such a file.
    """
    document = read_document(path)
    _check_keys(path, document)
    reference = document.get("reference")
    sensors = read_mapping(f"{path}: 'sensors'", document.get("sensors"))
    if not isinstance(reference, str) or not reference:
        raise InputError(f"{path}: reference is {reference!r}, expected the first sensor's name")
    if reference in sensors:
        raise InputError(
            f"{path}: the reference '{reference}' is also among the sensors, but their transforms "
            "are relative to it: remove one"
        )
    T_reference_sensor = {reference: np.eye(4)}
    for name in sensors:
        T_reference_sensor[str(name)] = _transform(path, name, sensors[name])
    return Extrinsics(
        reference=reference,
        T_reference_sensor=T_reference_sensor,
        T_map_reference=_transform(path, "map", document.get("map")),
        clocks=read_clocks(path, document, tuple(T_reference_sensor)),
        body=read_body(path, document.get("body")),
    )


def _check_keys(path: Path, document: Mapping[Any, Any]) -> None:
    """Reject keys similar to a known one: a typing error would be ignored silently."""
    known = [*OWN_KEYS, *SECTIONS]
    for key in map(str, document):
        meant = get_close_matches(key, known, n=1, cutoff=ALIKE)
        if key not in known and meant:
            raise InputError(f"{path} has a section '{key}', expected '{meant[0]}': rename it")


def load_extrinsics_of(path: Path, sensors: Sequence[str]) -> Extrinsics:
    """Read a calibration and check its sensors, the reference first.

    Raises:
        InputError: If the file is missing, is not such a file, or has other sensors.
    """
    extrinsics = load_extrinsics(path)
    if set(extrinsics.sensors) == set(sensors) and extrinsics.reference != sensors[0]:
        raise InputError(
            f"{path} has '{extrinsics.reference}' as the reference, which comes first, but the "
            f"sensors here begin with '{sensors[0]}': name them in the file's order, "
            f"sensors {' '.join(extrinsics.sensors)}"
        )
    if set(extrinsics.sensors) != set(sensors):
        raise InputError(
            f"{path} is a calibration of {', '.join(extrinsics.sensors)}, expected one of "
            f"{', '.join(sensors)}: name another file, or remove it to calibrate again"
        )
    return extrinsics


def _document(extrinsics: Extrinsics) -> dict[str, Any]:
    world: dict[str, Any] = _pose(extrinsics.T_map_reference)
    floor = extrinsics.floor
    if floor is not None:
        world["source"] = floor.source
        world["vertical_stddev_deg"] = rounded(np.degrees(floor.up_stddev), 2)
        world["height_stddev"] = rounded(floor.height_stddev, 4)
    sensors = {}
    for name in extrinsics.sensors[1:]:
        entry: dict[str, Any] = _pose(extrinsics.T_reference_sensor[name])
        if name in extrinsics.residuals:
            entry["residuals"] = _residuals(extrinsics.residuals[name])
        if name in extrinsics.board:
            entry["board"] = _board(extrinsics.board[name])
        sensors[name] = entry
    document: dict[str, Any] = {
        "version": VERSION,
        "reference": extrinsics.reference,
        "map": world,
        "sensors": sensors,
    }
    if extrinsics.clocks:
        document["clocks"] = clocks_document(extrinsics.clocks)
    if extrinsics.view_offsets:
        document["view_offsets"] = {
            name: {
                joint: rounded_list(offset, 4)
                for joint, offset in zip(JOINTS, offsets, strict=True)
            }
            for name, offsets in extrinsics.view_offsets.items()
        }
    return document


def _pose(T: FloatArray) -> dict[str, Any]:
    return {
        "translation": rounded_list(T[:3, 3], METRE_DIGITS),
        "rotation": quaternion_values(T[:3, :3], QUATERNION_DIGITS),
    }


def _residuals(pair: PairResiduals) -> dict[str, Any]:
    return {
        "partner": pair.partner,
        "frames": pair.frames,
        "raw_median": rounded(pair.raw_median, 4),
        "median": rounded(pair.median, 4),
        "inlier_rms": rounded(pair.inlier_rms, 4),
        "rotation_stddev_deg": rounded(np.degrees(pair.rotation_stddev), 3),
        "position_stddev": rounded(pair.position_stddev, 4),
        "inlier_share": {name: rounded(share, 3) for name, share in pair.inlier_share.items()},
    }


def _board(board: BoardResiduals) -> dict[str, Any]:
    return {
        "views": board.views,
        "reprojection_px": rounded(board.reprojection_px, 3),
        "rotation_stddev_deg": rounded(np.degrees(board.rotation_stddev), 4),
        "position_stddev": rounded(board.position_stddev, 5),
    }


def _transform(path: Path, name: Any, value: Any) -> FloatArray:
    entry = read_mapping(f"{path}: '{name}'", value)
    position = read_vector(f"{path}: the translation of '{name}'", entry.get("translation"), 3)
    R = read_rotation(f"{path}: the rotation of '{name}'", entry.get("rotation"))
    return rigid_transform(R, position)
