"""The section ``clocks`` of a session's file: see :mod:`extrinsics_file`."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pose_calibration.files.file_values import read_mapping, rounded
from pose_core.api import IMUS, ONE_IMU, Clock, Clocks, is_imus
from pose_core.errors import InputError

MAX_DRIFT_PPM = 1000.0  # [ppm] twenty times that of a bad quartz
PPM = 1e-6
NUMBERS = ("drift_ppm", "at_ns", "stddev_ms", "drift_stddev_ppm")  # beside offset_ns, if known


def clocks_document(clocks: Clocks) -> dict[str, Any]:
    """Clocks as plain values."""
    return {
        source: {
            "offset_ns": int(clock.offset_ns),
            "drift_ppm": rounded(clock.drift / PPM, 3),
            "at_ns": int(clock.at_ns),
            "stddev_ms": rounded(clock.stddev_s * 1e3, 3),
            "drift_stddev_ppm": rounded(clock.drift_stddev / PPM, 3),
        }
        for source, clock in clocks.items()
    }


def read_clocks(
    path: Path, document: Mapping[Any, Any], sensors: Sequence[str]
) -> dict[str, Clock]:
    """Read the clocks of a session's document, also of an older version.

    Args:
        path: The file, for messages.
        document: Its content.
        sensors: The file's sensors, the reference first.

    Raises:
        InputError: If an entry is of an unknown source, or invalid.
    """
    if document.get("version") in (1, 2):  # an offset without drift, in each sensor's entry
        entries = document.get("sensors") or {}
        return {
            str(name): Clock(offset_ns=_integer(path, f"sensors/{name}", entry, "clock_offset_ns"))
            for name, entry in entries.items()
            if "clock_offset_ns" in entry
        }
    clocks = document.get("clocks", {})
    section = read_mapping(f"{path}: 'clocks'", clocks, "a mapping of sources")
    return {str(name): _clock(path, name, entry, sensors) for name, entry in section.items()}


def _clock(path: Path, name: Any, entry: Any, sensors: Sequence[str]) -> Clock:
    if name not in sensors[1:] and not is_imus(str(name)):
        known = ", ".join([*sensors[1:], IMUS, ONE_IMU + "<segment>"])
        raise InputError(
            f"{path}: clocks has {name!r}, expected some of {known}: the clock of "
            f"'{sensors[0]}' is the reference"
        )
    where = f"clocks/{name}"
    entry = read_mapping(f"{path}: {where}", entry, "a mapping with 'offset_ns'")
    if "offset_ns" not in entry or set(map(str, entry)) - {"offset_ns", *NUMBERS}:
        raise InputError(
            f"{path}: {where} has {', '.join(map(str, entry)) or 'nothing'}, expected 'offset_ns' "
            f"and, if known, {', '.join(NUMBERS)}"
        )
    return Clock(
        offset_ns=_integer(path, where, entry, "offset_ns"),
        drift=PPM * _number(path, where, entry, "drift_ppm", -MAX_DRIFT_PPM),
        at_ns=_integer(path, where, entry, "at_ns"),
        stddev_s=1e-3 * _number(path, where, entry, "stddev_ms", 0.0),
        drift_stddev=PPM * _number(path, where, entry, "drift_stddev_ppm", 0.0),
    )


def _integer(path: Path, where: str, entry: Mapping[Any, Any], key: str) -> int:
    value = entry.get(key, 0)
    if not isinstance(value, int) or isinstance(value, bool):
        raise InputError(f"{path}: {where}/{key} is {value!r}, expected an integer")
    return value


def _number(path: Path, where: str, entry: Mapping[Any, Any], key: str, low: float) -> float:
    value = entry.get(key, 0.0)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and low <= float(value) <= MAX_DRIFT_PPM and math.isfinite(value)):
        raise InputError(
            f"{path}: {where}/{key} is {value!r}, expected a number from {low:g} to "
            f"{MAX_DRIFT_PPM:g}"
        )
    return float(value)
