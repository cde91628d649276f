"""Names of frames and topics."""

import re

WORLD_FRAME = "map"
SENSOR_FRAME = re.compile(r"^kinect_(?P<name>\w+)_optical_frame$")
BODIES = "/humans/bodies/"  # before a body's id
TRUTH_NAMESPACE = "/truth"
ABOUT_TOPIC = f"{TRUTH_NAMESPACE}/about"  # present if the subject is synthetic


def sensor_frame(sensor: str) -> str:
    """The frame of a Kinect's joints."""
    return f"kinect_{sensor}_optical_frame"
