"""A robot in the scene."""

from collections.abc import Mapping

from viser import FrameHandle, SceneApi

from pose_view.body.mesh import Mesh
from pose_view.robot import RobotSnapshot

COLOR = (203, 208, 216)


class RobotAvatar:
    """Draws a robot's links where they are.

    Args:
        scene: Where it is drawn.
    """

    def __init__(self, scene: SceneApi) -> None:
        self._scene = scene
        self._shape: Mapping[str, tuple[Mesh, ...]] | None = None
        self._frames: dict[str, FrameHandle] = {}

    def show(self, robot: RobotSnapshot) -> None:
        """Move it to where a snapshot says; its shape is drawn once."""
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
