"""Meshes of a robot's collision shapes, simplified for display."""

from typing import Any

import numpy as np

from pose_core.api import FloatArray
from pose_teleop.extras import require, share_folders
from pose_teleop.robot_arm import RobotArm

Faces = Any  # (m, 3) integers


def link_meshes(arm: RobotArm, cell_m: float) -> list[tuple[str, FloatArray, Faces]]:
    """The collision shapes: link, vertices [m] (k, 3) in the link's frame, faces (m, 3).

    Args:
        arm: An arm of the robot.
        cell_m: Vertices within a cell of this size are merged [m].
    """
    pin, whole = require("pinocchio"), arm.whole
    folders = [str(folder) for folder in share_folders()]
    geometry = pin.buildGeomFromUrdf(
        whole, str(arm.file.urdf), pin.GeometryType.COLLISION, None, folders
    )
    found = []
    for each in geometry.geometryObjects:
        mesh = _mesh(each.geometry)
        if mesh is None:
            continue
        vertices, faces = coarsened(mesh[0] * np.asarray(each.meshScale).ravel(), mesh[1], cell_m)
        frame = whole.frames[each.parentFrame]
        T = frame.placement.inverse() * each.placement
        if len(faces):
            found.append((frame.name, vertices @ T.rotation.T + T.translation, faces))
    return found


def coarsened(vertices: FloatArray, faces: Faces, cell_m: float) -> tuple[FloatArray, Faces]:
    """Simplify a mesh: merge the vertices within cells; faces without area are left out."""
    _, first, cell = np.unique(
        np.round(vertices / cell_m).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    joined = cell.ravel()[faces]
    a, b, c = joined.T
    kept = joined[(a != b) & (b != c) & (c != a)]
    return vertices[first], np.unique(kept, axis=0)


def _mesh(geometry: Any) -> tuple[FloatArray, Faces] | None:
    if hasattr(geometry, "num_tris"):
        triangles = (geometry.tri_indices(i) for i in range(geometry.num_tris))
        return np.array(geometry.vertices()), np.array([[t[0], t[1], t[2]] for t in triangles])
    if hasattr(geometry, "halfSide"):
        return _box(np.asarray(geometry.halfSide).ravel())
    if hasattr(geometry, "halfLength"):
        return _prism(float(geometry.radius), float(geometry.halfLength))
    if hasattr(geometry, "radius"):
        return _box(np.full(3, float(geometry.radius) / np.sqrt(3.0)))
    return None


def _box(half: FloatArray) -> tuple[FloatArray, Faces]:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return signs * half, np.array(faces)


def _prism(radius: float, half_length: float, sides: int = 16) -> tuple[FloatArray, Faces]:
    turn = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(sides)], axis=1)
    ends = np.array([[0.0, 0.0, -half_length], [0.0, 0.0, half_length]])
    vertices = np.vstack([ring + ends[0], ring + ends[1], ends])
    i = np.arange(sides)
    j = (i + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    faces = [
        (i, j, j + sides),
        (i, j + sides, i + sides),
        (low, j, i),
        (high, i + sides, j + sides),
    ]
    return vertices, np.concatenate([np.stack(each, axis=1) for each in faces])
