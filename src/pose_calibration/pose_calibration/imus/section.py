"""The section ``imus`` of the session's file: the sensor-to-segment alignment of each IMU.

.. code-block:: yaml

    imus:
      version: 1
      segments:
        left_thigh:
          rotation: [0.12, -0.03, 0.61, 0.78]  # R_sensor_segment, quaternion x, y, z, w
          stddev_deg: [1.2, 0.9, 2.4]  # about the segment's x, y, z
          z_down: true  # only if the z axis of the sensor's reference frame points down (NED)
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pose_calibration.files.extrinsics_file import read_document, write_document
from pose_calibration.files.file_values import (
    quaternion_values,
    read_mapping,
    read_rotation,
    read_vector,
    rounded_list,
)
from pose_core.api import SensorsToSegments, SensorToSegment
from pose_core.errors import InputError
from pose_core.joints import SEGMENTS

NAME = "imus"
VERSION = 1
QUATERNION_DIGITS = 6
MAX_STDDEV_DEG = 180.0


def save_alignments(path: Path, alignments: SensorsToSegments) -> None:
    """Write the section into an existing session's file; other sections are kept.

    Raises:
        InputError: If the file is not a session or cannot be written.
    """
    write_document(path, {**read_document(path), NAME: alignments_document(alignments)})


def alignments_document(alignments: SensorsToSegments) -> dict[str, Any]:
    """The section's content, without IMUs that are exchanged: their names may be mended next."""
    segments = {}
    for name in SEGMENTS:
        if name in alignments and not alignments[name].exchanged_with:
            alignment = alignments[name]
            stddev_deg = np.minimum(np.degrees(alignment.stddev), MAX_STDDEV_DEG)
            segments[name] = {
                "rotation": quaternion_values(alignment.R_sensor_segment, QUATERNION_DIGITS),
                "stddev_deg": rounded_list(stddev_deg, 2),
                **({"z_down": True} if alignment.z_down else {}),
            }
    return {"version": VERSION, "segments": segments}


def load_alignments(path: Path) -> SensorsToSegments | None:
    """Read the section; None if the file has none.

    Raises:
        InputError: If the file is not a session, or the section is invalid.
    """
    section = read_document(path).get(NAME)
    if section is None:
        return None
    return read_alignments(f"{path}: section '{NAME}'", section)


def read_alignments(where: str, section: Any) -> SensorsToSegments:
    """Parse the section's content.

    Raises:
        InputError: If it is invalid.
    """
    section = read_mapping(where, section)
    if section.get("version") != VERSION:
        raise InputError(
            f"{where} has version {section.get('version')!r}, expected {VERSION}: calibrate again"
        )
    segments = section.get("segments")
    if not isinstance(segments, Mapping):
        raise InputError(f"{where} has segments: {segments!r}, expected a mapping")
    strange = [str(name) for name in segments if name not in SEGMENTS]
    if strange:
        raise InputError(
            f"{where} names {', '.join(strange)}, expected segments: {', '.join(SEGMENTS)}"
        )
    return {name: _alignment(f"{where}, {name}", entry) for name, entry in segments.items()}


def load_alignments_if_any(imus_file: str, extrinsics_file: str) -> tuple[str, SensorsToSegments]:
    """Read the alignments of the first named session's file, if it exists.

    Returns:
        The file's name, empty if none is named; and its alignments, which may be empty.

    Raises:
        InputError: If the file exists, but is invalid.
    """
    name = imus_file or extrinsics_file
    if not name or not Path(name).expanduser().exists():
        return name, {}
    return name, load_alignments(Path(name).expanduser()) or {}


def _alignment(where: str, entry: Any) -> SensorToSegment:
    entry = read_mapping(where, entry, "rotation, stddev_deg")
    R_sensor_segment = read_rotation(f"{where}: the rotation", entry.get("rotation"))
    stddev = read_vector(f"{where}: stddev_deg", entry.get("stddev_deg"), 3)
    if not ((stddev > 0.0) & (stddev <= MAX_STDDEV_DEG)).all():
        raise InputError(f"{where}: stddev_deg is {stddev.tolist()}, expected (0, 180]")
    return SensorToSegment(
        R_sensor_segment=R_sensor_segment,
        stddev=np.radians(stddev),
        z_down=entry.get("z_down") is True,
    )
