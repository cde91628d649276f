"""The truth of a session as a rosbag, as a reference for estimates."""

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.typesys.store import Typestore
from scipy.spatial.transform import Rotation

from pose_core.joints import JOINTS, TrackingState
from pose_core.stamps import NS_PER_S
from pose_io.bag_writer import BagWriter
from pose_io.typestore import make_typestore
from pose_sim.angles import JOINT_NAMES, true_joint_angles
from pose_sim.motion import GRID_RATE
from pose_sim.session import Session

TRUTH_RATE = 100.0  # [Hz]
SUBJECT = "subject"
BODY_TOPIC = f"/truth/humans/bodies/{SUBJECT}"
SKELETON_TOPIC = f"{BODY_TOPIC}/skeleton"
JOINT_STATES_TOPIC = f"{BODY_TOPIC}/joint_states"
TF_TOPIC = "/truth/tf_static"
ABOUT_TOPIC = "/truth/about"  # says that all of it is synthetic


def write_truth(path: Path, session: Session, start_ns: int, note: str) -> None:
    """Write the true joints and joint angles at 100 Hz, and the sensors' poses.

    Args:
        path: Folder to make.
        session: The session.
        start_ns: Stamp [ns] of the session's time zero.
        note: Where the data come from.

    Raises:
        InputError: If the folder exists or cannot be written.
    """
    typestore = make_typestore()
    step = round(GRID_RATE / TRUTH_RATE)
    times = session.motion.times
    angles = np.stack(list(true_joint_angles(session.motion).values()), axis=1)
    rates = np.gradient(angles, times, axis=0)
    joints = session.motion.pose.joints
    make = _Messages(typestore)
    with BagWriter(path, typestore=typestore) as bag:
        bag.add_topic(ABOUT_TOPIC, "std_msgs/msg/String", latched=True)
        bag.add_topic(TF_TOPIC, "tf2_msgs/msg/TFMessage", latched=True)
        bag.write(ABOUT_TOPIC, make.text(note), start_ns)
        bag.write(TF_TOPIC, make.transforms(session, start_ns), start_ns)
        for index in range(0, len(times), step):
            stamp_ns = start_ns + round(float(times[index]) * NS_PER_S)
            bag.write(SKELETON_TOPIC, make.skeleton(joints[index], stamp_ns), stamp_ns)
            states = make.joint_state(angles[index], rates[index], stamp_ns)
            bag.write(JOINT_STATES_TOPIC, states, stamp_ns)


class _Messages:
    """Messages of a typestore from arrays."""

    def __init__(self, typestore: Typestore) -> None:
        types = typestore.types
        self._time = types["builtin_interfaces/msg/Time"]
        self._header = types["std_msgs/msg/Header"]
        self._string = types["std_msgs/msg/String"]
        self._point = types["geometry_msgs/msg/Point"]
        self._vector = types["geometry_msgs/msg/Vector3"]
        self._quaternion = types["geometry_msgs/msg/Quaternion"]
        self._transform = types["geometry_msgs/msg/Transform"]
        self._transform_stamped = types["geometry_msgs/msg/TransformStamped"]
        self._transforms = types["tf2_msgs/msg/TFMessage"]
        self._skeleton = types["pose_msgs/msg/Skeleton"]
        self._joint_state = types["sensor_msgs/msg/JointState"]
        self._names = list(JOINTS)
        self._tracked = np.full(len(JOINTS), TrackingState.TRACKED, dtype=np.uint8)
        self._angle_names = list(JOINT_NAMES)

    def _stamped(self, stamp_ns: int, frame_id: str) -> Any:
        seconds, nanoseconds = divmod(stamp_ns, NS_PER_S)
        return self._header(stamp=self._time(sec=seconds, nanosec=nanoseconds), frame_id=frame_id)

    def text(self, text: str) -> Any:
        return self._string(data=text)

    def skeleton(self, joints: np.ndarray, stamp_ns: int) -> Any:
        return self._skeleton(
            header=self._stamped(stamp_ns, "map"),
            id=SUBJECT,
            name=self._names,
            position=[self._point(x=x, y=y, z=z) for x, y, z in joints.tolist()],
            tracking_state=self._tracked,
        )

    def joint_state(self, angles: np.ndarray, rates: np.ndarray, stamp_ns: int) -> Any:
        return self._joint_state(
            header=self._stamped(stamp_ns, ""),
            name=self._angle_names,
            position=angles,
            velocity=rates,
            effort=np.empty(0),
        )

    def transforms(self, session: Session, stamp_ns: int) -> Any:
        transforms = []
        for name, pose in session.sensor_poses.items():
            x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
            place = dict(zip("xyz", pose[:3, 3].tolist(), strict=True))
            transforms.append(
                self._transform_stamped(
                    header=self._stamped(stamp_ns, "map"),
                    child_frame_id=f"kinect_{name}_optical_frame",
                    transform=self._transform(
                        translation=self._vector(**place),
                        rotation=self._quaternion(x=x, y=y, z=z, w=w),
                    ),
                )
            )
        return self._transforms(transforms=transforms)
