"""Meshes of a robot's collision shapes, simplified for display."""

from itertools import product
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from pose_core.api import FloatArray
from pose_teleop.extras import require, share_folders
from pose_teleop.robot_arm import RobotArm

Faces = Any  # (m, 3) integers
TURN = 2.0 * np.pi * np.arange(16) / 16.0
BOX = np.array([*product((-1.0, 1.0), repeat=3)])
PRISM = np.array([(np.cos(a), np.sin(a), z) for z in (-1.0, 1.0) for a in TURN])
"""Corners of a box and of a prism with 16 sides, of half-length one."""


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
        return _hull(BOX * np.asarray(geometry.halfSide).ravel())
    if hasattr(geometry, "halfLength"):
        return _hull(PRISM * [geometry.radius, geometry.radius, geometry.halfLength])
    if hasattr(geometry, "radius"):
        return _hull(BOX * (geometry.radius / np.sqrt(3.0)))
    return None


def _hull(vertices: FloatArray) -> tuple[FloatArray, Faces]:
    """Triangles of a convex body, counterclockwise seen from outside."""
    hull = ConvexHull(vertices)
    a, b, c = np.moveaxis(vertices[hull.simplices], 1, 0)
    is_inward = np.sum(np.cross(b - a, c - a) * hull.equations[:, :3], axis=1) < 0.0
    faces = np.where(is_inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    return vertices, faces
