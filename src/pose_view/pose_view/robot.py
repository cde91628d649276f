"""A robot in tele-operation: its meshes, poses of its links, history of its joints."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_view.mesh import Mesh

ROOT = "robot"  # its root frame, and the prefix of its links' frames
TRIANGLE_LIST = 11  # of visualization_msgs/Marker


@dataclass(frozen=True, kw_only=True)
class RobotSnapshot:
    """A robot at one instant.

    Attributes:
        shape: Meshes by link; the same object while they are unchanged.
        position: [m] (3,) of each link in map.
        wxyz: (4,) quaternion of each link in map.
    """

    shape: Mapping[str, tuple[Mesh, ...]]
    position: Mapping[str, FloatArray]
    wxyz: Mapping[str, FloatArray]


@dataclass(frozen=True, kw_only=True)
class JointTrack:
    """History of joint angles, oldest first."""

    joints: tuple[str, ...]  # (j,)
    times_s: FloatArray  # (n,) [s] on the clock
    position: FloatArray  # (n, j) [rad]


class JointHistory:
    """Recent joint states of one topic.

    Args:
        span_ns: Duration of the history [ns].
    """

    def __init__(self, span_ns: int) -> None:
        self._span_ns = span_ns
        self._joints: tuple[str, ...] = ()
        self._states: deque[tuple[int, FloatArray]] = deque()

    def add(self, message: Any) -> None:
        """Add a ``sensor_msgs/JointState``; other joints or decreasing stamps clear the history."""
        stamp = nanoseconds(message.header.stamp)
        joints = tuple(message.name)
        if joints != self._joints or (self._states and stamp < self._states[-1][0]):
            self._states.clear()
        self._joints = joints
        self._states.append((stamp, np.asarray(message.position, float)))
        while stamp - self._states[0][0] > self._span_ns:
            self._states.popleft()

    def track(self) -> JointTrack:
        """The whole history."""
        return JointTrack(
            joints=self._joints,
            times_s=np.array([stamp for stamp, _ in self._states], float) / NS_PER_S,
            position=np.array([position for _, position in self._states]),
        )


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


def root_and_links(message: Any, prefix: str) -> tuple[list[Any], Rotation] | None:
    """The transforms of a root, whose frame has a prefix, and of its links; their rotations.

    None if there is no such root, or a quaternion is zero.
    """
    root = next((t for t in message.transforms if t.child_frame_id.startswith(prefix)), None)
    if root is None:
        return None
    found = [root, *(t for t in message.transforms if t.header.frame_id == root.child_frame_id)]
    try:
        return found, Rotation.from_quat(
            [(q.x, q.y, q.z, q.w) for q in (t.transform.rotation for t in found)]
        )
    except ValueError:
        return None


def robot_places(message: Any) -> tuple[dict[str, FloatArray], dict[str, FloatArray]] | None:
    """Position [m] and quaternion (w, x, y, z) in map by link; None if it is not a robot's.

    Args:
        message: ``tf2_msgs/TFMessage``: the root in map first, all links in the root.
    """
    found = root_and_links(message, ROOT)
    if found is None:
        return None
    transforms, turns = found
    places = np.array([(p.x, p.y, p.z) for p in (t.transform.translation for t in transforms)])
    in_map = turns[0].apply(places[1:]) + places[0]
    wxyz = (turns[0] * turns[1:]).as_quat()[:, [3, 0, 1, 2]]
    names = [each.child_frame_id for each in transforms[1:]]
    return dict(zip(names, in_map, strict=True)), dict(zip(names, wxyz, strict=True))
