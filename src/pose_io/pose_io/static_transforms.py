"""Poses of the Kinects from the transforms of ``/tf_static``."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from pose_core.api import Extrinsics, extrinsics_from_map, matrix_of_quaternion, rigid_transform
from pose_core.arrays import FloatArray
from pose_core.errors import InputError
from pose_io.names import SENSOR_FRAME, WORLD_FRAME

FARTHEST = 1e7  # [m] between two frames on Earth


class StaticTransforms:
    """The transforms of all messages on ``/tf_static`` so far."""

    def __init__(self) -> None:
        self._transforms: dict[str, Any] = {}

    def add(self, message: Any) -> dict[str, FloatArray]:
        """Add a ``tf2_msgs/TFMessage``; returns the result of :func:`transforms_to_map`.

        Raises:
            InputError: As :func:`transforms_to_map`; then the message is not added.
        """
        added = {transform.child_frame_id: transform for transform in message.transforms}
        transforms = {**self._transforms, **added}
        placed = transforms_to_map(transforms.values())
        self._transforms = transforms
        return placed

    def extrinsics(self, message: Any, sensors: Sequence[str]) -> Extrinsics | None:
        """As :meth:`add`; returns the sensors' extrinsics, once all of them have a pose."""
        placed = self.add(message)
        if not all(sensor in placed for sensor in sensors):
            return None
        return extrinsics_from_map({sensor: placed[sensor] for sensor in sensors})


def transforms_to_map(transforms: Iterable[Any]) -> dict[str, FloatArray]:
    """``T_map_sensor``, (4, 4), of each Kinect among ``geometry_msgs/TransformStamped``.

    The last transform of a frame is used. Sensors without a path to ``map`` are left out.

    Raises:
        InputError: If a transform on such a path has a zero quaternion, NaN or infinity.
    """
    parents = {transform.child_frame_id: transform for transform in transforms}
    found = {
        m["name"]: _to_world(m[0], parents) for m in map(SENSOR_FRAME.match, sorted(parents)) if m
    }
    return {name: T_map_sensor for name, T_map_sensor in found.items() if T_map_sensor is not None}


def _matrix(transform: Any) -> FloatArray:
    """The (4, 4) matrix of a ``geometry_msgs/TransformStamped``."""
    q, t = transform.transform.rotation, transform.transform.translation
    R = np.empty((3, 3))
    if q.x == q.y == q.z == q.w == 0.0:
        raise InputError(
            f"the transform of {transform.child_frame_id} has no rotation: its quaternion is zero"
        )
    matrix_of_quaternion(np.array([q.x, q.y, q.z, q.w], float), R)
    matrix = rigid_transform(R, (t.x, t.y, t.z))
    if not np.isfinite(matrix).all():
        raise InputError(f"the transform of {transform.child_frame_id} holds NaN or infinity")
    farthest = np.abs(matrix[:3, 3]).max()
    if farthest > FARTHEST:
        raise InputError(
            f"the transform of {transform.child_frame_id} reaches {farthest:g} m, expected at most "
            f"{FARTHEST:g} m"
        )
    return matrix


def _to_world(frame: str, parents: Mapping[str, Any]) -> FloatArray | None:
    T_world_frame = np.eye(4)
    for _ in range(len(parents) + 1):  # bounded, also for a cycle of frames
        if frame == WORLD_FRAME:
            return T_world_frame
        if frame not in parents:
            return None
        T_world_frame = _matrix(parents[frame]) @ T_world_frame
        frame = parents[frame].header.frame_id
    return None
