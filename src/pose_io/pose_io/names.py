"""Names of frames and topics."""

import re

WORLD_FRAME = "map"
TF_STATIC = "/tf_static"
DIAGNOSTICS = "/diagnostics"
FUSE_STATUS = "fuse"  # name of the status in which a fused bag holds what was said about it
SKELETON_ARRAY = "pose_msgs/msg/SkeletonArray"  # type of a Kinect's frames
SENSOR_FRAME = re.compile(r"^kinect_(?P<name>\w+)_optical_frame$")
BODIES = "/humans/bodies/"  # before a body's id
TRUTH_NAMESPACE = "/truth"
ABOUT_TOPIC = f"{TRUTH_NAMESPACE}/about"  # present if the subject is synthetic


def skeletons_topic(sensor: str) -> str:
    """The topic of a Kinect's frames, in the graph's namespace."""
    return f"kinect_{sensor}/skeletons"


def imu_topic(segment: str) -> str:
    """The topic of an IMU's orientations, in the graph's namespace."""
    return f"imu_{segment}/data"


def sensor_frame(sensor: str) -> str:
    """The frame of a Kinect's joints."""
    return f"kinect_{sensor}_optical_frame"
