"""Shapes of a robot's links for display."""

from types import SimpleNamespace

import numpy as np
import pytest

from pose_teleop.robot_meshes import _mesh

SHAPES = {
    "box": (SimpleNamespace(halfSide=np.array([[0.1], [0.2], [0.3]])), 0.048),
    "cylinder": (SimpleNamespace(radius=0.1, halfLength=0.5), 8.0 * np.sin(np.pi / 8.0) * 0.01),
    "ball": (SimpleNamespace(radius=np.sqrt(3.0)), 8.0),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_closed_and_its_triangles_face_outward(name):
    geometry, volume = SHAPES[name]
    vertices, faces = _mesh(geometry)

    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    assert np.sum(a * np.cross(b, c)) / 6.0 == pytest.approx(volume)
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert {tuple(edge) for edge in edges} == {tuple(edge) for edge in edges[:, ::-1]}
