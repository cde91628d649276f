"""The scene: avatars side by side, the sensors' poses, and raw skeletons as ghosts."""

import time
from collections.abc import Mapping, Sequence

import numpy as np
from viser import CameraHandle, ClientHandle, LineSegmentsHandle

from pose_core.api import FloatArray, transformed
from pose_core.joints import JOINT_INDEX, SKELETON_LINES
from pose_view.body.poses import quaternions
from pose_view.snapshot import Snapshot
from pose_view.web.avatar import EXPECTED_AT, Avatar, RobotAvatar
from pose_view.web.places import BodyPanel
from pose_view.web.server import LocalServer

SPACING = 1.5  # [m] between avatars, to the left and right of the middle one
KINECT_SIZE = (0.25, 0.066, 0.067)  # [m] width, height, depth of a Kinect v2
KINECT_COLOR = (52, 54, 60)
FIELD_OF_VIEW = np.radians(60.0)  # [rad] of a Kinect v2's depth camera, vertically
GHOST_COLORS = ((86, 180, 233), (213, 94, 0), (240, 228, 66), (120, 94, 160))
GHOST_LINES = np.array(
    [(JOINT_INDEX[a], JOINT_INDEX[b]) for a, b in (("left_hip", "right_hip"), *SKELETON_LINES)]
)
CAMERA_FOV = np.radians(42.0)  # [rad] vertically
CAMERA_PITCH = np.radians(30.0)  # [rad] downward: the sensors do not hide the bodies
SETTLING_S = 5.0  # [s] until a new page's layout is complete
LOOK_AT_HEIGHT = 0.80  # [m]
HALF_HEIGHT = 1.15  # [m] visible above and below
ARM = 1.0  # [m] visible beside the outer avatars


class Stage:
    """All objects of the scene.

    Args:
        server: The server.
        places: Bodies from left to right; the middle one is at its position in map.
        absent: Text for a body without data, by id.
    """

    def __init__(
        self, server: LocalServer, places: Sequence[BodyPanel], absent: Mapping[str, str]
    ) -> None:
        self._server = server
        scene = server.scene
        scene.set_up_direction("+z")
        scene.configure_environment_map("studio", environment_intensity=0.45)
        scene.add_grid(
            "/floor",
            infinite_grid=True,
            cell_color=(222, 224, 228),
            section_color=(196, 199, 205),
            cell_size=0.5,
            section_size=1.0,
            fade_distance=14.0,
            plane_color=(246, 247, 249),
            plane_opacity=1.0,
            shadow_opacity=0.25,
        )
        middle = (len(places) - 1) / 2.0
        self.avatars: dict[str, Avatar] = {}
        for index, place in enumerate(places):
            self.add(place, absent[place.body], SPACING * (middle - index))
        self._centre_body = places[len(places) // 2].body if places else ""
        self._sensors: dict[str, FloatArray] = {}
        self._ghosts: dict[str, LineSegmentsHandle] = {}
        self._robot = RobotAvatar(scene)
        self.has_view = False
        """Whether every browser's camera is set to the first person; False resets it."""
        self._has_robot = False
        self._reach = SPACING * middle  # [m] of the outer avatars from the middle one
        self._set_view(np.array(EXPECTED_AT), None)
        server.on_client_connect(self._welcome)
        self.shows_sensors = True
        self.shows_ghosts = False
        """Whether each camera's raw skeletons are drawn, transformed by the extrinsics."""

    def add(self, place: BodyPanel, absent: str, left: float = 0.0) -> None:
        """Add a body, displaced to the left of its position in map by ``left`` [m]."""
        self.avatars[place.body] = Avatar(self._server.scene, place, (0.0, left, 0.0), absent)

    def remove(self, body: str) -> None:
        """Remove a body that was added."""
        self.avatars.pop(body).remove()

    def show(self, snapshot: Snapshot) -> None:
        """Draw a snapshot in one update."""
        with self._server.atomic():
            for name, avatar in self.avatars.items():
                avatar.set_data(name in snapshot.bodies)
                if name in snapshot.bodies:
                    avatar.show(snapshot.bodies[name], snapshot.imus)
            if snapshot.robot is not None:
                self._robot.show(snapshot.robot)
                has_robot = bool(snapshot.robot.position)
                self.has_view &= has_robot == self._has_robot
                self._has_robot = has_robot
            self._show_sensors(snapshot)
            self._show_ghosts(snapshot)
        if not self.has_view and snapshot.bodies:
            body = snapshot.bodies.get(self._centre_body) or next(iter(snapshot.bodies.values()))
            self.has_view = bool(np.isfinite(body.joints).all())
            if self.has_view:
                links = snapshot.robot.position if snapshot.robot is not None else {}
                robot = np.mean([*links.values()], axis=0) if links else None
                self._set_view(body.joints.mean(axis=0), robot)

    def _set_view(self, body: FloatArray, robot: FloatArray | None) -> None:
        """Set the camera to the sensors' side, for current and future browsers.

        Args:
            body: Position of the middle avatar [m], (3,).
            robot: Position of a robot [m], (3,); None without one.
        """
        sides = [body[1] - self._reach, body[1] + self._reach]
        if robot is not None:
            sides.append(robot[1])
        self._centre = np.array([body[0], (min(sides) + max(sides)) / 2.0])
        self._half_width = (max(sides) - min(sides)) / 2.0 + ARM
        position, target = self._camera(aspect=1.2)
        initial = self._server.initial_camera
        initial.position, initial.look_at, initial.fov = position, target, CAMERA_FOV
        for client in self._server.get_clients().values():
            self._place_camera(client)

    def _welcome(self, client: ClientHandle) -> None:
        """Set a new browser's camera, and again when its layout is complete."""
        self._place_camera(client)
        until_s = time.monotonic() + SETTLING_S
        placed_for = client.camera.aspect

        @client.camera.on_update
        def _(camera: CameraHandle) -> None:
            nonlocal placed_for
            if time.monotonic() < until_s and abs(camera.aspect - placed_for) > 0.02:
                placed_for = camera.aspect
                self._place_camera(client)

    def _place_camera(self, client: ClientHandle) -> None:
        """Set a browser's camera so that all avatars are visible at its aspect ratio."""
        position, target = self._camera(client.camera.aspect)
        with client.atomic():
            client.camera.fov = CAMERA_FOV
            client.camera.position = position
            client.camera.look_at = target

    def _camera(self, aspect: float) -> tuple[FloatArray, FloatArray]:
        """Position and target of the camera [m] for an aspect ratio (width to height)."""
        half = np.tan(CAMERA_FOV / 2.0)
        distance = max(HALF_HEIGHT / half, self._half_width / (half * aspect))
        target = np.array([self._centre[0], self._centre[1], LOOK_AT_HEIGHT])
        back = np.array([-np.cos(CAMERA_PITCH), 0.0, np.sin(CAMERA_PITCH)])
        return target + distance * back, target

    def _show_sensors(self, snapshot: Snapshot) -> None:
        for name, T in snapshot.sensors.items():
            known = self._sensors.get(name)
            if known is None or not np.allclose(known, T, atol=1e-4):
                self._draw_sensor(name, T)
        self._sensors = dict(snapshot.sensors)
        for name in self._sensors:
            node = self._server.scene.get_handle_by_name(f"/sensors/{name}")
            if node is not None:
                node.visible = self.shows_sensors

    def _draw_sensor(self, name: str, T: FloatArray) -> None:
        scene, node = self._server.scene, f"/sensors/{name}"
        wxyz = quaternions(T[None, :3, :3])[0]
        scene.add_frame(node, show_axes=False, wxyz=wxyz, position=T[:3, 3])
        scene.add_box(f"{node}/case", color=KINECT_COLOR, dimensions=KINECT_SIZE)
        scene.add_camera_frustum(
            f"{node}/view",
            fov=FIELD_OF_VIEW,
            aspect=1.2,
            scale=0.11,
            thickness=1.5,
            thickness_units="screen",
            color=(90, 120, 170),
        )
        above = (0.0, 0.08, 0.0)
        scene.add_label(f"{node}/name", f"Kinect {name}", anchor="top-center", position=above)

    def _show_ghosts(self, snapshot: Snapshot) -> None:
        for index, (sensor, skeletons) in enumerate(sorted(snapshot.raw.items())):
            T = snapshot.sensors.get(sensor)
            if not self.shows_ghosts or T is None or not skeletons:
                node = self._ghosts.pop(sensor, None)
                if node is not None:
                    node.remove()
                continue
            joints = np.concatenate([each.positions for each in skeletons])
            starts = len(JOINT_INDEX) * np.arange(len(skeletons))
            lines = transformed(T, joints)[(starts[:, None, None] + GHOST_LINES).reshape(-1, 2)]
            lines[~np.isfinite(lines).all(axis=(1, 2))] = 0.0  # of no length
            points, color = lines.astype(np.float32), GHOST_COLORS[index % len(GHOST_COLORS)]
            node = self._ghosts.get(sensor)
            if node is not None and node.points.shape == points.shape:
                node.points = points
                continue
            self._ghosts[sensor] = self._server.scene.add_line_segments(
                f"/ghosts/{sensor}", points, color, thickness=4.0, thickness_units="screen"
            )
