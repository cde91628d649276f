"""Frames of a source as ROS messages."""

from geometry_msgs.msg import Point
from pose_msgs.msg import Skeleton, SkeletonArray

from kinect_bridge.source import SkeletonFrame
from pose_core.joints import JOINTS
from pose_node.conversions import to_header


def to_skeleton_array(frame: SkeletonFrame, frame_id: str) -> SkeletonArray:
    """Convert a frame with all persons; joints that are not tracked are NaN."""
    header = to_header(frame.stamp_ns, frame_id)
    return SkeletonArray(
        header=header,
        skeletons=[
            Skeleton(
                header=header,
                id=person,
                name=list(JOINTS),
                position=[Point(x=x, y=y, z=z) for x, y, z in positions.tolist()],
                tracking_state=states.tolist(),
            )
            for person, positions, states in zip(
                frame.person, frame.positions, frame.tracking_state, strict=True
            )
        ],
    )
