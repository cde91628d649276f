"""Frames of a recording as ROS messages."""

from geometry_msgs.msg import Point
from pose_msgs.msg import Skeleton, SkeletonArray
from std_msgs.msg import Header

from pose_core.joints import JOINTS
from pose_io.recordings.recording import SensorStream
from pose_node.conversions import ns_to_stamp


def to_skeleton_array(
    stream: SensorStream, frame: int, stamp_ns: int, frame_id: str
) -> SkeletonArray:
    """Everybody in a frame; joints that are not tracked are NaN."""
    header = Header(stamp=ns_to_stamp(stamp_ns), frame_id=frame_id)
    return SkeletonArray(
        header=header,
        skeletons=[
            Skeleton(
                header=header,
                id=stream.person[row],
                name=list(JOINTS),
                position=[Point(x=x, y=y, z=z) for x, y, z in stream.positions[row].tolist()],
                tracking_state=stream.tracking_state[row].tolist(),
            )
            for row in stream.rows(frame)
        ],
    )
