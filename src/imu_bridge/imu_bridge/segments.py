"""Which node is strapped to which segment, and how its sensors are calibrated: the nodes file.

Calibrated = ``matrix @ (measured - offset)``, in the axes of the sensor.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from pose_common.errors import InputError
from pose_common.joints import SEGMENTS

MAX_NODE_ID = 255

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Linear:
    """Calibration of a three-axis sensor.

    Attributes:
        offset: In the sensor's unit, shape (3,).
        matrix: Scale and misalignment [-], shape (3, 3).
    """

    offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    matrix: FloatArray = field(default_factory=lambda: np.eye(3))


@dataclass(frozen=True, kw_only=True)
class ImuNode:
    """One node of the star network.

    Attributes:
        node_id: Its id on the wire, 0 to 255.
        segment: The body segment it is strapped to.
        gyroscope_bias: [rad/s], shape (3,).
        accelerometer: Calibration, offset in [m/s^2].
        magnetometer: Calibration (hard and soft iron), offset in [T].
    """

    node_id: int
    segment: str
    gyroscope_bias: FloatArray = field(default_factory=lambda: np.zeros(3))
    accelerometer: Linear = field(default_factory=Linear)
    magnetometer: Linear = field(default_factory=Linear)


def read_nodes(path: Path) -> tuple[ImuNode, ...]:
    """Read a nodes file; the nodes in its order.

    Raises:
        InputError: If the file cannot be read or says something that makes no sense.
    """
    try:
        document = yaml.load(path.read_text(encoding="utf-8"), Loader=_UniqueKeyLoader)
    except OSError as error:
        raise InputError(f"cannot read the nodes file {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path} is not YAML: {reason}") from error
    try:
        return parse_nodes(document)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def parse_nodes(document: Any) -> tuple[ImuNode, ...]:
    """The nodes from a nodes file's content, see :func:`read_nodes`."""
    top = _mapping(document, "the file", {"nodes"})
    entries = top.get("nodes")
    if not isinstance(entries, Mapping) or not entries:
        raise InputError("expected a mapping 'nodes' of node id to segment, such as '1: torso'")
    nodes = tuple(_node(node_id, entry) for node_id, entry in entries.items())
    wearer: dict[str, int] = {}
    for node in nodes:
        if node.segment in wearer:
            raise InputError(
                f"segment '{node.segment}' is given to nodes {wearer[node.segment]} and "
                f"{node.node_id}: one node a segment"
            )
        wearer[node.segment] = node.node_id
    return nodes


def _node(node_id: Any, entry: Any) -> ImuNode:
    if type(node_id) is not int or not 0 <= node_id <= MAX_NODE_ID:
        raise InputError(f"node id {node_id!r} is not a whole number from 0 to {MAX_NODE_ID}")
    where = f"node {node_id}"
    if isinstance(entry, str):
        entry = {"segment": entry}
    keys = {"segment", "gyroscope_bias", "accelerometer", "magnetometer"}
    entry = _mapping(entry, where, keys)
    segment = entry.get("segment")
    if segment not in SEGMENTS:
        raise InputError(f"{where}: segment {segment!r} is not one of {', '.join(SEGMENTS)}")
    return ImuNode(
        node_id=node_id,
        segment=segment,
        gyroscope_bias=_numbers(entry, "gyroscope_bias", where, np.zeros(3)),
        accelerometer=_linear(entry, "accelerometer", where),
        magnetometer=_linear(entry, "magnetometer", where),
    )


def _linear(entry: Mapping[str, Any], key: str, where: str) -> Linear:
    where = f"{where}: {key}"
    values = _mapping(entry.get(key, {}), where, {"offset", "matrix"})
    calibration = Linear(
        offset=_numbers(values, "offset", where, np.zeros(3)),
        matrix=_numbers(values, "matrix", where, np.eye(3)),
    )
    determinant = float(np.linalg.det(calibration.matrix))
    if determinant <= 0.0:
        raise InputError(
            f"{where}: matrix has determinant {determinant:.3g}; expected a positive one "
            "(scales about 1 on the diagonal, axes not mirrored)"
        )
    return calibration


def _numbers(values: Mapping[str, Any], key: str, where: str, default: FloatArray) -> FloatArray:
    """An array of ``default``'s shape."""
    if key not in values:
        return default
    try:
        array = np.array(values[key], dtype=float)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if array.shape != default.shape or not np.isfinite(array).all():
        shape = " x ".join(map(str, default.shape))
        raise InputError(f"{where}: {key} = {values[key]!r} is not {shape} numbers")
    return array


def _mapping(value: Any, where: str, keys: set[str]) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise InputError(f"{where}: expected a mapping with {', '.join(sorted(keys))}")
    unknown = [key for key in value if key not in keys]
    if unknown:
        raise InputError(f"{where}: unknown key '{unknown[0]}', expected {', '.join(sorted(keys))}")
    return value


class _UniqueKeyLoader(yaml.SafeLoader):
    """YAML without PyYAML's silence on repeated keys: two nodes with one id are a mistake."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise yaml.constructor.ConstructorError(
                    None, None, f"{key!r} cannot be a key", key_node.start_mark
                )
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"'{key}' occurs twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)
