"""One drawn body in the scene."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from viser import FrameHandle, MeshHandle, SceneApi

from pose_core.joints import SIDE_SIGNS
from pose_view.body.joint_marks import BALLS, BANDS, COLORS, ball_place, joint_marks, make_balls
from pose_view.body.measures import MeasuredBody
from pose_view.body.parts import PARTS, make_parts
from pose_view.body.poses import part_poses, quaternions
from pose_view.mesh import Mesh
from pose_view.robot import RobotSnapshot
from pose_view.snapshot import BodySnapshot
from pose_view.web.places import BodyPanel

EXPECTED_AT = (2.0, 0.0, 0.0)  # [m] assumed position before a person is tracked
COLOR = (203, 208, 216)


TITLE_BEFORE = 0.25  # [m] in front of the body, on the floor
IMU_COLOR = (60, 60, 66)
IMU_SIZE = (0.016, 0.036, 0.046)  # [m] across the limb, along its sides
IMU_PLACES = {  # segment: part, fraction of the length from the part's origin, position on it [m]
    "pelvis": ("pelvis", (-0.118, 0.0, 0.03)),
    "torso": ("thorax", (-0.118, 0.0, 0.14)),
    "head": ("head", (-0.105, 0.0, 0.24)),
    **{
        f"{side}_{limb}": (f"{side}_{limb}", (x, sign * y, -z))
        for side, sign in SIDE_SIGNS.items()
        for limb, x, y, z in (
            ("upper_arm", 0.0, 0.054, 0.16),
            ("forearm", 0.0, 0.042, 0.18),
            ("thigh", 0.0, 0.084, 0.2),
            ("shank", 0.0, 0.056, 0.18),
        )
    },
}


class RobotAvatar:
    """Draws a robot's links.

    Args:
        scene: The scene.
    """

    def __init__(self, scene: SceneApi) -> None:
        self._scene = scene
        self._shape: Mapping[str, tuple[Mesh, ...]] | None = None
        self._frames: dict[str, FrameHandle] = {}

    def show(self, robot: RobotSnapshot) -> None:
        """Move the links to a snapshot's poses; the meshes are drawn once."""
        if robot.shape is not self._shape:
            self._draw(robot.shape)
        for link, frame in self._frames.items():
            if link in robot.position:
                frame.position, frame.wxyz = robot.position[link], robot.wxyz[link]

    def _draw(self, shape: Mapping[str, tuple[Mesh, ...]]) -> None:
        for frame in self._frames.values():
            frame.remove()
        self._shape, self._frames = shape, {}
        for link, meshes in shape.items():
            name = f"/robots/{link}"
            self._frames[link] = self._scene.add_frame(name, show_axes=False)
            for number, mesh in enumerate(meshes):
                self._scene.add_mesh_simple(
                    f"{name}/{number}", mesh.vertices, mesh.faces, color=COLOR, flat_shading=True
                )


class Avatar:
    """A shaded body that follows a stream of snapshots.

    Args:
        scene: The scene.
        place: The body's name and colour.
        offset: Displacement from its position in map [m].
        absent: Title before the first snapshot.
    """

    def __init__(
        self, scene: SceneApi, place: BodyPanel, offset: Sequence[float], absent: str
    ) -> None:
        self._scene = scene
        self._name = f"/bodies/{place.body}"
        self._place = place
        self._body = MeasuredBody()
        self._imus: tuple[str, ...] = ()
        self.is_wanted = True
        """The user's choice: whether to show the body."""
        self._frame = scene.add_frame(self._name, show_axes=False, position=np.asarray(offset))
        self._parts: list[MeshHandle] = []
        self._balls: dict[str, MeshHandle] = {}
        self._label = scene.add_label(
            f"{self._name}/title",
            f"{place.title}: {absent}",
            position=np.array(EXPECTED_AT),
            anchor="top-center",
            font_screen_scale=1.25,
        )

    def show(self, body: BodySnapshot, imus: tuple[str, ...] = ()) -> None:
        """Move the body to a snapshot's pose."""
        if not np.isfinite(body.joints).all():
            return
        imus = imus if self._place.wears_imus else ()
        if self._body.add(body.joints) or (self._parts and imus != self._imus):
            self._imus = imus
            self._draw()
        if not self._parts:
            return
        positions, rotations = part_poses(body.joints, body.rotations)
        wxyz = quaternions(rotations)
        for part, position, turn in zip(self._parts, positions, wxyz, strict=True):
            part.position, part.wxyz = position, turn
        for joint, mark in joint_marks(body).items():
            ball = self._balls[joint]
            ball.color = mark.color
            ball.scale = (1.0, 1.0, mark.growth) if joint in BANDS else (mark.growth,) * 3
        x, y, _ = positions[PARTS.index("pelvis")]
        self._label.position = (x - TITLE_BEFORE, y, 0.02)

    def remove(self) -> None:
        """Remove the body from the scene."""
        self._frame.remove()

    def set_data(self, has_data: bool) -> None:
        """Hide the body while it has no data."""
        self._frame.visible = self.is_wanted and (has_data or not self._parts)

    def _draw(self) -> None:
        """Draw the meshes again after a change of the body's measures or IMUs."""
        measures = self._body.measures
        assert measures is not None
        for part in self._parts:
            part.remove()  # with its children
        self._parts = [
            self._add(part, mesh, self._place.skin) for part, mesh in make_parts(measures).items()
        ]
        for joint, mesh in make_balls(measures).items():
            name, place = f"{BALLS[joint].part}/{joint}", ball_place(joint, measures)
            self._balls[joint] = self._add(name, mesh, COLORS["predicted"], position=place)
        for segment in self._imus:
            if segment in IMU_PLACES:
                carrier, place = IMU_PLACES[segment]
                x, y, z = IMU_SIZE
                # Its thin side to the body: back and front are along x, a limb's sides along y.
                size = (x, y, z) if abs(place[0]) > abs(place[1]) else (y, x, z)
                position = tuple(np.array(place) * measures.size)
                name = f"{self._name}/{carrier}/imu"
                self._scene.add_box(name, color=IMU_COLOR, dimensions=size, position=position)
        self._label.text = self._place.title

    def _add(
        self, name: str, mesh: Mesh, color: tuple[int, int, int], **options: Any
    ) -> MeshHandle:
        return self._scene.add_mesh_simple(
            f"{self._name}/{name}", mesh.vertices, mesh.faces, color=color, **options
        )
