"""Poses of the virtual Kinects and the subject's initial position, after li2020.

``map`` has its origin below the first sensor and x along its viewing direction. One Kinect faces
the subject at about 2 m, the other is moved aside, turned towards the subject and tilted.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import rigid_transform
from pose_core.arrays import FloatArray
from pose_core.parameters import parameter

SENSORS = ("left", "right")


@dataclass(frozen=True, kw_only=True)
class SceneParameters:
    """Parameters of the scene."""

    distance: float = parameter(
        2.2,
        unit="m",
        limits=(1.0, 4.5),
        doc="horizontal distance of the sensors from the subject's starting position",
    )
    sensor_height: float = parameter(
        1.3, unit="m", limits=(0.3, 3.0), doc="height of both sensors above the floor"
    )
    aside: float = parameter(
        38.0,
        unit="deg",
        limits=(-180.0, 180.0),
        doc="angle by which the right sensor is moved around the subject, to the subject's right",
    )
    tilt: float = parameter(
        8.0, unit="deg", limits=(-45.0, 45.0), doc="downward tilt of both sensors"
    )
    roll: float = parameter(3.0, unit="deg", limits=(-45.0, 45.0), doc="roll of the right sensor")
    body_height: float = parameter(1.75, unit="m", limits=(1.2, 2.2), doc="the subject's height")


def subject_place(scene: SceneParameters) -> tuple[tuple[float, float], float]:
    """The subject's initial position x, y [m] in ``map``, and heading [rad] to the sensor."""
    return (scene.distance, 0.0), np.pi


def sensor_poses(scene: SceneParameters) -> dict[str, FloatArray]:
    """``T_map_kinect_<name>_optical_frame`` by name, shape (4, 4) each."""
    middle, _ = subject_place(scene)
    poses = {}
    for name, aside, roll in zip(SENSORS, (0.0, scene.aside), (0.0, scene.roll), strict=True):
        around = np.radians(aside)
        away = middle - scene.distance * np.array([np.cos(around), np.sin(around)])
        position = np.append(away, scene.sensor_height)
        poses[name] = optical_pose(position, around, np.radians(scene.tilt), np.radians(roll))
    return poses


def optical_pose(position: FloatArray, heading: float, tilt: float, roll: float) -> FloatArray:
    """``T_map_optical`` of a camera with the viewing direction ``heading``, ``tilt`` down [rad]."""
    R_map_camera = Rotation.from_euler("ZYX", (heading, tilt, roll)).as_matrix()  # x forward, z up
    R_camera_optical = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    return rigid_transform(R_map_camera @ R_camera_optical, position)
