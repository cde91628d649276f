"""Messages of samples, for tests that publish or record them."""

from geometry_msgs.msg import Point
from pose_msgs.msg import Skeleton, SkeletonArray

from pose_core.joints import JOINTS
from pose_node.conversions import to_header


def points(positions):
    """Positions [m], (n, 3), as a message has them."""
    return [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in positions]


def skeleton_message(one, names=JOINTS):
    """What a sensor publishes of one person."""
    header = to_header(one.stamp_ns, f"kinect_{one.sensor}_optical_frame")
    skeleton = Skeleton(
        header=header,
        id=one.person,
        name=list(names),
        position=points(one.positions),
        tracking_state=one.tracking_state.tolist(),
    )
    return SkeletonArray(header=header, skeletons=[skeleton])
