"""Segment of each node, and the calibration of its sensors.

Calibrated = ``matrix @ (measured - offset)``, in the axes of the sensor.
"""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_core.finite_numbers import finite_numbers
from pose_core.joints import SEGMENTS

MAX_NODE_ID = 255
NODE_KEYS = frozenset({"segment", "gyroscope_bias", "accelerometer", "magnetometer"})


@dataclass(frozen=True, kw_only=True)
class Linear:
    """Calibration of a three-axis sensor."""

    offset: FloatArray = field(default_factory=lambda: np.zeros(3))  # (3,) in the sensor's unit
    matrix: FloatArray = field(default_factory=lambda: np.eye(3))
    """Scale and misalignment [-], shape (3, 3)."""


@dataclass(frozen=True, kw_only=True)
class ImuNode:
    """One sensor."""

    node_id: int  # in the protocol, 0 to 255; 0 if the port has only one sensor
    segment: str  # the body segment that carries it
    port: int = 0  # index of its port
    gyroscope_bias: FloatArray = field(default_factory=lambda: np.zeros(3))  # (3,) [rad/s]
    accelerometer: Linear = field(default_factory=Linear)  # offset in [m/s^2]
    magnetometer: Linear = field(default_factory=Linear)  # hard and soft iron, offset in [T]


def nodes_of(entries: Any, port: int) -> list[ImuNode]:
    """The nodes of one port from a mapping of node id to segment, or to segment and calibration.

    Raises:
        InputError: If it is no such mapping.
    """
    if not isinstance(entries, Mapping) or not entries:
        raise InputError("expected a mapping 'nodes' of node id to segment, such as '1: torso'")
    return [node_of(node_id, entry, port) for node_id, entry in entries.items()]


def refuse_double_segments(nodes: Sequence[ImuNode], port_names: Sequence[str]) -> None:
    """Raise an :class:`InputError` if two nodes have the same segment."""
    wearer: dict[str, ImuNode] = {}
    for node in nodes:
        before = wearer.setdefault(node.segment, node)
        if before is not node:
            where = (
                f"nodes {before.node_id} and {node.node_id}"
                if before.port == node.port
                else f"{port_names[before.port]} and {port_names[node.port]}"
            )
            raise InputError(f"segment '{node.segment}' is given to {where}: one node per segment")


def node_of(node_id: Any, entry: Any, port: int) -> ImuNode:
    """One node from its entry in the file.

    Raises:
        InputError: If the id, the segment or a calibration is invalid.
    """
    if type(node_id) is not int or not 0 <= node_id <= MAX_NODE_ID:
        raise InputError(f"node id {node_id!r} is not an integer from 0 to {MAX_NODE_ID}")
    where = f"node {node_id}"
    if isinstance(entry, str):
        entry = {"segment": entry}
    entry = mapping(entry, where, NODE_KEYS)
    segment = entry.get("segment")
    if segment not in SEGMENTS:
        raise InputError(f"{where}: segment {segment!r} is not one of {', '.join(SEGMENTS)}")
    return ImuNode(
        node_id=node_id,
        segment=segment,
        port=port,
        gyroscope_bias=_numbers(entry, "gyroscope_bias", where, np.zeros(3)),
        accelerometer=_linear(entry, "accelerometer", where),
        magnetometer=_linear(entry, "magnetometer", where),
    )


def _linear(entry: Mapping[str, Any], key: str, where: str) -> Linear:
    where = f"{where}: {key}"
    values = mapping(entry.get(key, {}), where, {"offset", "matrix"})
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
    array = finite_numbers(values[key], *default.shape)
    if array is None:
        shape = " x ".join(map(str, default.shape))
        raise InputError(f"{where}: {key} = {values[key]!r} is not {shape} numbers")
    return array


def mapping(value: Any, where: str, keys: Set[str]) -> Mapping[str, Any]:
    """The value, or an :class:`InputError` raised if it is no mapping with known keys."""
    if not isinstance(value, Mapping):
        raise InputError(f"{where}: expected a mapping with {', '.join(sorted(keys))}")
    unknown = [key for key in value if key not in keys]
    if unknown:
        raise InputError(f"{where}: unknown key '{unknown[0]}', expected {', '.join(sorted(keys))}")
    return value
