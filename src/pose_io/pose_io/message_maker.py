"""Messages of a typestore, made of numbers, to be written into bags without ROS."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys.store import Typestore
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS
from pose_core.stamps import NS_PER_S
from pose_io.arrays import ByteArray
from pose_io.names import WORLD_FRAME, sensor_frame

if TYPE_CHECKING:  # slow to import
    from pose_core.api import SkeletonSample


class MessageMaker:
    """Makes the messages of sensors and their transforms."""

    def __init__(self, typestore: Typestore) -> None:
        self._types = typestore.types

    def make(self, kind: str, /, **fields: Any) -> Any:
        """A message of the type ``package/Name``."""
        package, _, name = kind.partition("/")
        return self._types[f"{package}/msg/{name}"](**fields)

    def header(self, stamp_ns: int, frame_id: str = "") -> Any:
        """A header."""
        sec, nanosec = divmod(stamp_ns, NS_PER_S)
        stamp = self.make("builtin_interfaces/Time", sec=sec, nanosec=nanosec)
        return self.make("std_msgs/Header", stamp=stamp, frame_id=frame_id)

    def skeleton(
        self, header: Any, person: str, positions: FloatArray, tracking_state: ByteArray
    ) -> Any:
        """One person's joints, (15, 3) [m] in the header's frame, and their states, (15,)."""
        point = self._types["geometry_msgs/msg/Point"]
        return self.make(
            "pose_msgs/Skeleton",
            header=header,
            id=person,
            name=list(JOINTS),
            position=[point(x=x, y=y, z=z) for x, y, z in positions.tolist()],
            tracking_state=tracking_state,
        )

    def skeletons(self, header: Any, skeletons: Sequence[Any]) -> Any:
        """A sensor's frame: all persons of :meth:`skeleton`."""
        return self.make("pose_msgs/SkeletonArray", header=header, skeletons=list(skeletons))

    def frame(self, header: Any, persons: Iterable["SkeletonSample"]) -> Any:
        """A sensor's frame of these persons."""
        skeletons = (
            self.skeleton(header, p.person, p.positions, p.tracking_state) for p in persons
        )
        return self.skeletons(header, [*skeletons])

    def imu(
        self,
        header: Any,
        orientation: FloatArray,
        orientation_stddev: FloatArray,
        angular_velocity: FloatArray,
        linear_acceleration: FloatArray | None = None,
    ) -> Any:
        """An IMU's sample.

        Args:
            header: Stamp and frame.
            orientation: Quaternion x, y, z, w.
            orientation_stddev: (3,) [rad].
            angular_velocity: (3,) [rad/s].
            linear_acceleration: (3,) [m/s²]; None: marked as not measured (REP 145).
        """
        acceleration, marked = linear_acceleration, 0.0
        if acceleration is None:
            acceleration, marked = np.zeros(3), -1.0
        return self.make(
            "sensor_msgs/Imu",
            header=header,
            orientation=self._quaternion(orientation),
            orientation_covariance=np.diag(np.square(orientation_stddev)).ravel(),
            angular_velocity=self._vector(angular_velocity),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._vector(acceleration),
            linear_acceleration_covariance=np.array([marked, *[0.0] * 8]),
        )

    def sensor_transforms(self, T_map_sensor: Mapping[str, FloatArray], stamp_ns: int) -> Any:
        """Poses of Kinects in map, (4, 4) by sensor name, for ``/tf_static``."""
        transforms = [
            self.make(
                "geometry_msgs/TransformStamped",
                header=self.header(stamp_ns, WORLD_FRAME),
                child_frame_id=sensor_frame(name),
                transform=self.make(
                    "geometry_msgs/Transform",
                    translation=self._vector(T[:3, 3]),
                    rotation=self._quaternion(Rotation.from_matrix(T[:3, :3]).as_quat()),
                ),
            )
            for name, T in T_map_sensor.items()
        ]
        return self.make("tf2_msgs/TFMessage", transforms=transforms)

    def _vector(self, values: FloatArray) -> Any:
        x, y, z = values.tolist()
        return self.make("geometry_msgs/Vector3", x=x, y=y, z=z)

    def _quaternion(self, values: FloatArray) -> Any:
        x, y, z, w = values.tolist()
        return self.make("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w)
