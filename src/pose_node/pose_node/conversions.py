"""Between messages and values: stamps, transforms and nodes' reports."""

from collections.abc import Iterable

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

from pose_core.stamps import NS_PER_S
from pose_node.node_status import Level, NodeStatus


def ns_to_stamp(stamp_ns: int) -> Time:
    """A message's stamp from nanoseconds."""
    seconds, rest = divmod(stamp_ns, NS_PER_S)
    return Time(sec=seconds, nanosec=rest)


def to_header(stamp_ns: int, frame_id: str = "") -> Header:
    """A message's header."""
    return Header(stamp=ns_to_stamp(stamp_ns), frame_id=frame_id)


def to_transform(header: Header, child: str, place: Iterable[float]) -> TransformStamped:
    """A frame's transform, from x, y, z [m] and the quaternion x, y, z, w."""
    x, y, z, qx, qy, qz, qw = map(float, place)
    turn = Quaternion(x=qx, y=qy, z=qz, w=qw)
    transform = Transform(translation=Vector3(x=x, y=y, z=z), rotation=turn)
    return TransformStamped(header=header, child_frame_id=child, transform=transform)


def to_node_status(status: DiagnosticStatus, received_ns: int) -> NodeStatus:
    """A node's report, received at a time [ns]."""
    return NodeStatus(
        name=status.name,
        level=Level(min(status.level[0], Level.STALE)),
        message=status.message,
        values={entry.key: entry.value for entry in status.values},
        received_ns=received_ns,
    )
