"""Reading joint maps: shipped ones by name, users' own by path; the README has the format.

``like: NAME`` starts from a shipped map; the file's keys replace those of the shipped map, and its
entries of ``map`` replace single entries.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.finite_numbers import finite_numbers
from pose_core.joints import JOINTS
from pose_core.plain_yaml import read_yaml
from pose_io.recordings.joint_maps import ConfidenceLevels, JointMap

FOLDER = Path(__file__).parent / "joint_map_data"
SHIPPED = tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))

KEYS = ("like", "sensor", "unit", "axes", "joints", "map", "confidence")
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
DIRECTIONS = {  # in the optical frame: x right, y down, z forward
    "right": (1, 0, 0),
    "left": (-1, 0, 0),
    "down": (0, 1, 0),
    "up": (0, -1, 0),
    "forward": (0, 0, 1),
    "backward": (0, 0, -1),
}
MAX_JOINTS = 128
MAX_SOURCES = 8  # maximum number of source joints for one joint
MAX_NAME = 64  # [characters]


def find_joint_map(name_or_path: str) -> JointMap:
    """A shipped map by its name, or a user's own by its path.

    Raises:
        InputError: If it does not exist, or is not a valid joint map.
    """
    if name_or_path in SHIPPED:
        return shipped_joint_map(name_or_path)
    path = Path(name_or_path).expanduser()
    if not path.is_file():
        raise InputError(
            f"found no joint map '{name_or_path}': give the path of a YAML file, or one of "
            f"{', '.join(SHIPPED)}"
        )
    return _make(path, _with_base(path))


@cache
def shipped_joint_map(name: str) -> JointMap:
    """One of :data:`SHIPPED`."""
    path = FOLDER / f"{name}.yaml"
    return _make(path, _with_base(path))


def _with_base(path: Path, depth: int = 0) -> dict[str, Any]:
    """The file's values merged into those of its base map."""
    document = read_yaml(path, "the joint map")
    if not isinstance(document, dict):
        raise InputError(f"{path} holds no joint map: expected the keys {', '.join(KEYS)}")
    unknown = [str(key) for key in document if key not in KEYS]
    if unknown:
        raise InputError(f"{path}: unknown key '{unknown[0]}', expected some of {', '.join(KEYS)}")
    base = document.pop("like", None)
    if base is None:
        return document
    if base not in SHIPPED or depth > len(SHIPPED):
        raise InputError(f"{path}: like = {base!r} is not one of the maps {', '.join(SHIPPED)}")
    below = _with_base(FOLDER / f"{base}.yaml", depth + 1)
    joint_map = document.get("map", {})
    if isinstance(joint_map, dict):
        document["map"] = {**below["map"], **joint_map}
    return {**below, **document}


def _make(path: Path, document: Mapping[str, Any]) -> JointMap:
    """Validate the values and create the map."""
    sources = _sources(path, document.get("map"))
    joints = _joints(path, document.get("joints"), sources)
    named = {
        ours: tuple(_name(path, ours, theirs, joints) for theirs in values)
        for ours, values in sources.items()
    }
    unit = document.get("unit", "m")
    if not isinstance(unit, str) or unit not in UNITS_M:
        raise InputError(f"{path}: unit = {unit!r}, expected one of {', '.join(UNITS_M)}")
    return JointMap(
        sensor=str(document.get("sensor", path.stem))[:MAX_NAME],
        joints=joints,
        sources=named,
        R_optical_sdk=_rotation(path, document.get("axes")),
        unit_m=UNITS_M[unit],
        confidence=_confidence(path, document.get("confidence")),
    )


def _sources(path: Path, value: Any) -> dict[str, list[str | int]]:
    if not isinstance(value, dict) or not value:
        raise InputError(f"{path}: 'map' is missing: expected 'head: NAME' and so on")
    unknown = [str(key) for key in value if key not in JOINTS]
    if unknown:
        raise InputError(
            f"{path}: map has '{unknown[0]}', which is not one of our joints {', '.join(JOINTS)}"
        )
    sources = {
        ours: theirs if isinstance(theirs, list) else [theirs] for ours, theirs in value.items()
    }
    for ours, theirs in sources.items():
        fits = 0 < len(theirs) <= MAX_SOURCES
        if not fits or not all(type(each) in (str, int) for each in theirs):
            raise InputError(
                f"{path}: map of '{ours}' is {theirs!r}: expected a joint of the source, or a list "
                f"of at most {MAX_SOURCES}: names or indices from 0"
            )
    return sources


def _joints(path: Path, value: Any, sources: Mapping[str, list[str | int]]) -> tuple[str, ...]:
    """The source's joints; if the file does not list them, those that the map names."""
    used = [each for values in sources.values() for each in values]
    if value is None:
        highest = max((each for each in used if isinstance(each, int)), default=-1)
        value = [str(number) for number in range(min(highest, MAX_JOINTS - 1) + 1)]
        value += dict.fromkeys(each for each in used if isinstance(each, str))
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        raise InputError(f"{path}: joints = {value!r}: expected a list of names")
    if len(value) > MAX_JOINTS or len(set(value)) < len(value):
        raise InputError(
            f"{path}: joints has {len(value)} names, {len(set(value))} of them different: expected "
            f"at most {MAX_JOINTS}, each once"
        )
    long = next((each for each in value if not 0 < len(each) <= MAX_NAME), None)
    if long is not None:
        raise InputError(
            f"{path}: joints has the name {long!r}: expected 1 to {MAX_NAME} characters"
        )
    return tuple(value)


def _name(path: Path, ours: str, theirs: str | int, joints: tuple[str, ...]) -> str:
    if isinstance(theirs, int) and 0 <= theirs < len(joints):
        return joints[theirs]
    if isinstance(theirs, str) and theirs in joints:
        return theirs
    raise InputError(
        f"{path}: '{ours}' is made from {theirs!r}, which is not one of the {len(joints)} joints "
        "in the source: correct the name"
    )


def _rotation(path: Path, value: Any) -> FloatArray:
    """The matrix whose columns are the source's x, y and z axes in the optical frame."""
    names = [str(value.get(axis)) for axis in "xyz"] if isinstance(value, dict) else [""]
    if not set(names) <= set(DIRECTIONS):
        raise InputError(
            f"{path}: axes = {value!r}: expected for example '{{x: right, y: down, z: forward}}', "
            f"from {', '.join(DIRECTIONS)}"
        )
    matrix = np.array([DIRECTIONS[name] for name in names], dtype=np.float64).T
    if abs(np.linalg.det(matrix)) != 1.0:
        raise InputError(f"{path}: axes = {value!r} are not perpendicular")
    return matrix


def _confidence(path: Path, value: Any) -> ConfidenceLevels | None:
    if value is None:
        return None
    given = value if isinstance(value, dict) else {}
    levels = finite_numbers([given.get("inferred"), given.get("tracked")], 2)
    if levels is None or levels[0] > levels[1]:
        raise InputError(
            f"{path}: confidence = {value!r}: expected the smallest value of each state, for "
            "example '{inferred: 1, tracked: 2}'"
        )
    return ConfidenceLevels(inferred=float(levels[0]), tracked=float(levels[1]))
