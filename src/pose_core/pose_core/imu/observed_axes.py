"""Axes of each segment as observed by the cameras: the long axis z and the lateral axis y.

The lateral axis of the trunk is the line through the shoulders, that of the pelvis the line through
the hips. That of a limb is the hinge axis of its knee or elbow, if this is bent. A forearm has
none, because it rotates about its long axis below the elbow.
"""

import math

import numpy as np
from numpy.typing import NDArray

from pose_core.body.model import BodyModel
from pose_core.joints import JOINT_INDEX
from pose_core.kernels.camera_geometry import AxisArrays, ObservedAxes, observe_axes
from pose_core.kernels.compiling import type_specialised
from pose_core.streams.samples import FloatArray

LEAST_BEND = math.sin(math.radians(30.0))  # [-] of a hinge whose axis is used
HINGE_SHARPNESS = 0.35  # [-] weight of a hinge axis at a right angle, relative to a long axis
LINES = {"pelvis": ("right_hip", "left_hip"), "torso": ("right_shoulder", "left_shoulder")}


class AxisObserver:
    """Computes the axes of a body's segments from joint positions."""

    def __init__(self, model: BodyModel) -> None:
        self._observe = type_specialised(observe_axes)
        self._arrays = axis_arrays(model)
        self._rows = {segment: row for row, segment in enumerate(model.segments)}
        self._rows_by_request: dict[tuple[str, ...], NDArray[np.int64]] = {}

    def of(
        self, segments: tuple[str, ...], positions: FloatArray, trunk: FloatArray
    ) -> ObservedAxes:
        """Axes of some segments, one for each row; NaN for segments that the model does not have.

        Args:
            segments: Their names.
            positions: Joints in map, shape (15, 3) [m]; NaN where not tracked.
            trunk: The trunk's axes in map, shape (3, 3).
        """
        rows = self._rows_by_request.get(segments)
        if rows is None:
            rows = np.array([self._rows.get(segment, -1) for segment in segments], np.int64)
            self._rows_by_request[segments] = rows
        long, lateral = np.empty((2, len(rows), 3))
        axes = ObservedAxes(long, lateral, np.empty(len(rows)))
        self._observe(self._arrays, rows, positions, trunk, LEAST_BEND, HINGE_SHARPNESS, axes)
        return axes


def axis_arrays(model: BodyModel) -> AxisArrays:
    """The joints that define the axes of a model's segments, in their order."""
    count = len(model.segments)
    arrays = AxisArrays(
        ends=np.zeros((count, 2), np.int64),
        direction=np.zeros(count),
        lines=np.full((count, 2), -1, np.int64),
        hinges=np.full((count, 4), -1, np.int64),
        hinge_direction=np.zeros((count, 3)),
    )
    for row, (segment, name) in enumerate(model.segments.items()):
        arrays.ends[row] = [JOINT_INDEX[joint] for joint in model.ends(name)]
        arrays.direction[row] = _direction(model, name)
        if segment in LINES:
            arrays.lines[row] = [JOINT_INDEX[joint] for joint in LINES[segment]]
        hinge = None if "forearm" in segment else _hinge(model, name)
        if hinge is not None:
            upper, lower = hinge
            bones = [*model.ends(upper), *model.ends(lower)]
            arrays.hinges[row] = [JOINT_INDEX[joint] for joint in bones]
            arrays.hinge_direction[row] = (
                _direction(model, upper),
                _direction(model, lower),
                model.links[lower].dof[0].axis[1],
            )
    return arrays


def _direction(model: BodyModel, link: str) -> float:
    """1 if a link's z points from its first to its second joint, −1 if back, 0 if neither."""
    direction = model.joints[model.ends(link)[1]].direction
    return 0.0 if direction is None else direction[2]


def _hinge(model: BodyModel, name: str) -> tuple[str, str] | None:
    """The links above and below the hinge at either end of a link, if there is one."""
    for link in model.links.values():
        if len(link.dof) == 1 and link.parent is not None and name in (link.parent, link.name):
            return link.parent, link.name
    return None
