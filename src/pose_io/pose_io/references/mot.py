"""MOT (and STO) files of OpenSim: joint angles alone, with OpenSim's names and signs."""

from pathlib import Path

import numpy as np

from pose_core.api import ANGLES, AngleSeries
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.joints import SIDES
from pose_io.export.opensim import LIMBS
from pose_io.references.reference import Reference, numbers_of, text_of

TURN = 2.0 * np.pi  # [rad] larger numbers are degrees; a motion without any may be in radians
KNEE_NOTE = (
    "its knees bend to negative angles, as in the older OpenSim models: the sign is reversed"
)
PELVIS_NOTE = (
    "OpenSim measures the hip against the pelvis; here it is measured against the trunk, so a bent "
    "spine shows as a difference"
)


def read_mot(path: Path) -> Reference:
    """Read the angles of a MOT file.

    Raises:
        InputError: If it is not a MOT file, contains none of the angles, or states a wrong unit.
    """
    columns, in_degrees = _table(path)
    stamps_ns = np.round(1e9 * columns["time"]).astype(np.int64)
    if (np.diff(stamps_ns) <= 0).any():
        raise InputError(f"{path}: its times do not increase")
    unit = np.pi / 180.0 if in_degrees else 1.0
    angles: dict[str, FloatArray] = {}
    for name in ANGLES:
        side, _, angle = name.partition("_")
        coordinate, sign = LIMBS[angle]
        found = columns.get(f"{coordinate}_{side[0]}")
        angles[name] = np.full(len(stamps_ns), np.nan) if found is None else sign * unit * found
    known = [name for name in ANGLES if np.isfinite(angles[name]).any()]
    if not known:
        wanted = ", ".join(f"{coordinate}_l" for coordinate, _ in LIMBS.values())
        raise InputError(
            f"{path} holds none of the angles: expected some of {wanted}, … of OpenSim, found "
            f"{', '.join(sorted(columns))}"
        )
    largest = max(float(np.nanmax(np.abs(angles[name]))) for name in known) / unit
    if not in_degrees and largest > TURN:
        raise InputError(
            f"{path}: its largest angle is {largest:.1f}, in radians by its header (inDegrees=no, "
            "or nothing), but no angle exceeds a turn: write inDegrees=yes"
        )
    notes = [PELVIS_NOTE]
    if in_degrees and largest < TURN:
        notes.append(
            f"its largest angle is {largest:.2f}°: if its angles are in radians, write inDegrees=no"
        )
    knees = [f"{side}_knee_flexion" for side in SIDES if f"{side}_knee_flexion" in known]
    if knees and np.nanmean([np.nanmean(angles[knee]) for knee in knees]) < 0.0:
        angles.update({knee: -angles[knee] for knee in knees})
        notes.append(KNEE_NOTE)
    series = AngleSeries(stamps_ns=stamps_ns, angles={name: angles[name] for name in ANGLES})
    return Reference(
        name=path.name, synthetic=False, angles=series, skeleton=None, notes=tuple(notes)
    )


def _table(path: Path) -> tuple[dict[str, FloatArray], bool]:
    """The columns by name, and whether angles are in degrees."""
    lines = text_of(path).splitlines()
    end = next((n for n, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None or end + 2 >= len(lines):
        raise InputError(
            f"{path} is not a MOT file: expected a header that closes with 'endheader'"
        )
    settings: dict[str, str] = {}
    for line in lines[:end]:
        key, _, value = line.partition("=")
        settings[key.strip().lower()] = value.strip().lower()
    names = lines[end + 1].split()
    rows = [
        numbers_of(path, number, line.split())
        for number, line in enumerate(lines[end + 2 :], end + 3)
        if line.strip()
    ]
    wrong = next((n for n, row in enumerate(rows, end + 3) if len(row) != len(names)), None)
    if not rows:
        raise InputError(f"{path} holds no instants")
    if wrong is not None:
        raise InputError(f"{path}, line {wrong}: expected {len(names)} numbers, as there are names")
    if "time" not in names:
        raise InputError(f"{path} has no column 'time': found {', '.join(names)}")
    table = np.array(rows)
    columns = {_coordinate(name): table[:, k] for k, name in enumerate(names)}
    return columns, settings.get("indegrees", "no") == "yes"


def _coordinate(name: str) -> str:
    """``hip_flexion_l`` of ``/jointset/hip_l/hip_flexion_l/value``, as OpenSim 4 writes states."""
    return name.removesuffix("/value").rpartition("/")[2] if name.endswith("/value") else name
