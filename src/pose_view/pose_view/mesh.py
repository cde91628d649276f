"""Closed surfaces lofted through ellipses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.api import FloatArray

RING = 20  # [-] vertices of a ring
CAP_RINGS = 4  # [-] rings of a rounded end
SPHERE_RINGS = 9  # [-]


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Triangle mesh, counterclockwise seen from outside."""

    vertices: FloatArray  # (v, 3) [m]
    faces: NDArray[np.uint32]  # (f, 3)


def loft(sections: Sequence[Sequence[float]], *, cap: float = 0.6) -> Mesh:
    """A surface through ellipses across the z axis, rounded off at both ends.

    Args:
        sections: Height z, half-axes along x and y, and the centre's x (0 if left out) of each
            ellipse [m], in ascending or descending order of z.
        cap: Height of the rounded ends, as a share of the end's mean half-axis.
    """
    rows = np.array([[*section, 0.0][:4] for section in sections], float)
    if rows[0, 0] > rows[-1, 0]:
        rows = rows[::-1]
    rows = np.concatenate([_cap(rows[0], -cap)[::-1], rows, _cap(rows[-1], cap)])
    angle = np.arange(RING) * (2.0 * np.pi / RING)
    z, half_x, half_y, centre = (column[:, None] for column in rows.T)
    rings = np.stack(
        [centre + half_x * np.cos(angle), half_y * np.sin(angle), z + 0.0 * angle], axis=2
    )
    poles = np.array([[rows[0, 3], 0.0, rows[0, 0]], [rows[-1, 3], 0.0, rows[-1, 0]]])
    return Mesh(
        vertices=np.concatenate([rings.reshape(-1, 3), poles]), faces=_ring_faces(len(rows))
    )


def ellipsoid(half_axes: Sequence[float]) -> Mesh:
    """An ellipsoid about the origin, by its half-axes along x, y, z [m]."""
    elevation = np.linspace(-np.pi / 2.0, np.pi / 2.0, SPHERE_RINGS + 2)[1:-1]
    unit = loft([(np.sin(e), np.cos(e), np.cos(e)) for e in elevation], cap=0.0)
    vertices = unit.vertices.copy()
    vertices[-2:] = [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]
    return scaled(Mesh(vertices=vertices, faces=unit.faces), half_axes)


def scaled(mesh: Mesh, factors: float | Sequence[float]) -> Mesh:
    """The mesh, enlarged about the origin by one factor or by those along x, y, z."""
    return Mesh(vertices=mesh.vertices * np.asarray(factors, float), faces=mesh.faces)


def moved(mesh: Mesh, offset: Sequence[float]) -> Mesh:
    """The mesh, translated by an offset [m]."""
    return Mesh(vertices=mesh.vertices + np.asarray(offset, float), faces=mesh.faces)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    faces = [mesh.faces + np.uint32(start) for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(vertices=vertices, faces=np.concatenate(faces))


def _cap(section: FloatArray, height: float) -> FloatArray:
    """The ellipses that close an end: a quarter of an ellipse, without the end itself."""
    if height == 0.0:
        return np.empty((0, 4))
    angle = np.linspace(0.0, np.pi / 2.0, CAP_RINGS + 2)[1:-1]
    angle = np.append(angle, np.radians(88.0))  # the pole follows
    rows = np.repeat(section[None], len(angle), axis=0)
    rows[:, 0] += height * 0.5 * (section[1] + section[2]) * np.sin(angle)
    rows[:, 1:3] *= np.cos(angle)[:, None]
    return rows


def _ring_faces(rings: int) -> NDArray[np.uint32]:
    """Triangles between neighbouring rings, and from the end rings to the two poles after them."""
    corner = np.arange(RING)
    after = (corner + 1) % RING
    faces = []
    for ring in range(rings - 1):
        low, high = ring * RING, (ring + 1) * RING
        faces.append(np.stack([low + corner, low + after, high + after], axis=1))
        faces.append(np.stack([low + corner, high + after, high + corner], axis=1))
    bottom, top = rings * RING, rings * RING + 1
    last = (rings - 1) * RING
    faces.append(np.stack([after, corner, np.full(RING, bottom)], axis=1))
    faces.append(np.stack([last + corner, last + after, np.full(RING, top)], axis=1))
    return np.concatenate(faces).astype(np.uint32)
