"""Messages of samples, for tests that publish them."""

from geometry_msgs.msg import Point
from pose_msgs.msg import Skeleton, SkeletonArray

from pose_common.conversions import ns_to_stamp
from pose_common.joints import JOINTS


def skeleton_message(one):
    """What a sensor publishes of one person."""
    skeleton = Skeleton(
        id=one.person,
        name=list(JOINTS),
        position=[Point(x=float(x), y=float(y), z=float(z)) for x, y, z in one.positions],
        tracking_state=one.tracking_state,
    )
    skeleton.header.stamp = ns_to_stamp(one.stamp_ns)
    skeleton.header.frame_id = f"kinect_{one.sensor}_optical_frame"
    return SkeletonArray(header=skeleton.header, skeletons=[skeleton])
