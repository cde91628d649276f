"""A robot that follows: its shape, from markers; where its links are, from transforms."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray
from pose_view.body.mesh import Mesh

ROOT = "robot"  # its frame, and the prefix of its links'
TRIANGLE_LIST = 11  # of visualization_msgs/Marker


@dataclass(frozen=True, kw_only=True)
class RobotSnapshot:
    """A robot at one instant.

    Attributes:
        shape: Meshes by the link that carries them; the same object while the shape is the same.
        position: [m] (3,) of each link in map.
        wxyz: (4,) quaternion of each link in map.
    """

    shape: Mapping[str, tuple[Mesh, ...]]
    position: Mapping[str, FloatArray]
    wxyz: Mapping[str, FloatArray]


def robot_shape(message: Any) -> dict[str, tuple[Mesh, ...]]:
    """Meshes by link, of a ``visualization_msgs/MarkerArray`` of triangles."""
    found: dict[str, tuple[Mesh, ...]] = {}
    for marker in message.markers:
        if marker.type != TRIANGLE_LIST or len(marker.points) % 3:
            continue
        corners = np.array([(p.x, p.y, p.z) for p in marker.points], float).reshape(-1, 3)
        vertices, rows = np.unique(corners, axis=0, return_inverse=True)
        mesh = Mesh(vertices=vertices, faces=rows.reshape(-1, 3).astype(np.uint32))
        link = marker.header.frame_id
        found[link] = (*found.get(link, ()), mesh)
    return found


def robot_places(message: Any) -> tuple[dict[str, FloatArray], dict[str, FloatArray]] | None:
    """Position [m] and quaternion (w, x, y, z) in map by link; None if it is no robot's.

    Args:
        message: ``tf2_msgs/TFMessage``: the root in map first, all links in the root.
    """
    transforms = message.transforms
    if not transforms or transforms[0].child_frame_id != ROOT:
        return None
    moved = [each.transform for each in transforms]
    places = np.array([(m.translation.x, m.translation.y, m.translation.z) for m in moved])
    try:
        turns = Rotation.from_quat(
            [(m.rotation.x, m.rotation.y, m.rotation.z, m.rotation.w) for m in moved]
        )
    except ValueError:  # a quaternion of zeros
        return None
    root = turns[0]
    in_map = root.apply(places[1:]) + places[0]
    wxyz = (root * turns[1:]).as_quat()[:, [3, 0, 1, 2]]
    names = [each.child_frame_id for each in transforms[1:]]
    return dict(zip(names, in_map, strict=True)), dict(zip(names, wxyz, strict=True))
