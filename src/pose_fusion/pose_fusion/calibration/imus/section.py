"""The section ``imus`` of the session's file: how each IMU sits on its segment.

.. code-block:: yaml

    imus:
      version: 1
      segments:
        left_thigh:
          rotation: [0.12, -0.03, 0.61, 0.78]  # R_sensor_segment, quaternion x, y, z, w
          stddev_deg: [1.2, 0.9, 2.4]  # about the segment's x, y, z
          residual_deg: 5.1  # RMS between where cameras and sensor see the segment point
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_common.errors import InputError
from pose_common.joints import SEGMENTS
from pose_fusion.calibration.session_file import load_section, save_section
from pose_fusion.imu.mounting import Mounting, Mountings
from pose_fusion.streams.samples import FloatArray

NAME = "imus"
VERSION = 1
UNIT_TOLERANCE = 1e-3  # [-] of a quaternion's length, for numbers rounded by hand
LARGEST_STDDEV_DEG = 180.0


def save_mountings(path: Path, mountings: Mountings) -> None:
    """Write the section into a session's file, which must exist; the rest of it stays.

    Raises:
        InputError: If the file is no session or cannot be written.
    """
    segments = {}
    for segment in (name for name in SEGMENTS if name in mountings):
        mounting = mountings[segment]
        quaternion = Rotation.from_matrix(mounting.R_sensor_segment).as_quat()
        quaternion *= np.sign(quaternion[3]) or 1.0  # of the two that mean the same, one
        segments[segment] = {
            "rotation": [_rounded(value, 6) for value in quaternion],
            "stddev_deg": [
                _rounded(min(value, LARGEST_STDDEV_DEG), 2) for value in np.degrees(mounting.stddev)
            ],
            "residual_deg": _rounded(np.degrees(mounting.residual), 2),
        }
    save_section(path, NAME, {"version": VERSION, "segments": segments})


def load_mountings(path: Path) -> Mountings | None:
    """Read the section; None if the file has none.

    Raises:
        InputError: If the file is no session, or the section is not what it should be.
    """
    section = load_section(path, NAME)
    if section is None:
        return None
    where = f"{path}: section '{NAME}'"
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
    return {name: _mounting(f"{where}, {name}", entry) for name, entry in segments.items()}


def load_mountings_if_any(imus_file: str, extrinsics_file: str) -> tuple[str, Mountings]:
    """The mountings that a session's file has: of the first file that is named, if it exists.

    Returns:
        The file's name, empty if none is named; and its mountings, none if it has none.

    Raises:
        InputError: If the file exists, but is not what it should be.
    """
    name = imus_file or extrinsics_file
    if not name or not Path(name).expanduser().exists():
        return name, {}
    return name, load_mountings(Path(name).expanduser()) or {}


def _mounting(where: str, entry: Any) -> Mounting:
    if not isinstance(entry, Mapping):
        raise InputError(f"{where} is {entry!r}, expected rotation, stddev_deg, residual_deg")
    quaternion = _numbers(where, entry, "rotation", 4)
    length = float(np.linalg.norm(quaternion))
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise InputError(
            f"{where}: the rotation has length {length:.4f}, expected a unit quaternion x, y, z, w"
        )
    stddev = _numbers(where, entry, "stddev_deg", 3)
    if not ((stddev > 0.0) & (stddev <= LARGEST_STDDEV_DEG)).all():
        raise InputError(f"{where}: stddev_deg is {stddev.tolist()}, expected (0, 180]")
    residual = entry.get("residual_deg")  # for people
    return Mounting(
        R_sensor_segment=Rotation.from_quat(quaternion).as_matrix(),
        stddev=np.radians(stddev),
        residual=np.radians(residual) if isinstance(residual, float) else np.nan,
    )


def _numbers(where: str, entry: Mapping[Any, Any], key: str, count: int) -> FloatArray:
    value = entry.get(key)
    try:
        numbers = np.array(value, dtype=float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise InputError(f"{where}: {key} is {value!r}, expected {count} numbers")
    return numbers


def _rounded(value: float, digits: int) -> float:
    return round(float(value), digits) + 0.0  # no negative zero
