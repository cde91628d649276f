"""The node ``retarget``: publishes the whole body as named poses for humanoid retargeters."""

from typing import Any

import numpy as np
from rclpy.node import Node
from tf2_msgs.msg import TFMessage

from pose_core.counters import Counters
from pose_core.stamps import nanoseconds
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.message_types import message_class
from pose_node.nodes.qos import reliable
from pose_node.nodes.running import run_node
from pose_teleop.conversions import fill_named_poses
from pose_teleop.parameters import RetargetParameters
from pose_teleop.retargeting import SMPL, smpl_poses

TOPIC = "xr_teleop/full_body"
TF_QOS = reliable(20)


class RetargetNode(Node):
    """Converts the person's frames to SMPL's 24 joints.

    Args:
        **options: As for ``rclpy.node.Node``.

    Raises:
        PoseError: If the message's type is not installed, or a parameter is invalid.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("retarget", **options)
        self._settings = declare_parameters(self, RetargetParameters)
        self._type = message_class(self._settings.message_type)
        self._counters = Counters("poses", "frames_missing", "not_finite")
        self._reported = 0
        self._publisher = self.create_publisher(self._type, TOPIC, 10)
        self.create_subscription(TFMessage, "tf", self._on_tf, TF_QOS)
        self._diagnostics = DiagnosticsPublisher(self, self._report)

    def _on_tf(self, message: TFMessage) -> None:
        transforms, subject = message.transforms, self._settings.subject
        if not transforms or transforms[0].child_frame_id != f"body_{subject}":
            return
        moved = [each.transform for each in transforms]
        position = [(m.translation.x, m.translation.y, m.translation.z) for m in moved]
        xyzw = [(m.rotation.x, m.rotation.y, m.rotation.z, m.rotation.w) for m in moved]
        if not (np.isfinite(position).all() and np.isfinite(xyzw).all()):
            self._counters.add("not_finite")
            return
        names = [each.child_frame_id for each in transforms]
        in_body = self._settings.frame == "body"
        poses = smpl_poses(names, np.array(position), np.array(xyzw), subject, in_body)
        if poses is None:
            self._counters.add("frames_missing")
            return
        self._counters.add("poses")
        frame = f"body_{subject}" if in_body else transforms[0].header.frame_id
        stamp_ns = nanoseconds(transforms[0].header.stamp)
        self._publisher.publish(fill_named_poses(self._type(), poses, SMPL, stamp_ns, frame))

    def _report(self) -> Report:
        sent = self._counters["poses"] - self._reported
        self._reported += sent
        level = Level.OK if sent else Level.WARN
        message = f"{sent} poses/s on {TOPIC}" if sent else "no frames of the person on /tf"
        return Report(level=level, message=message, values=self._counters.as_dict())


def main() -> None:
    """Run the node."""
    run_node(RetargetNode, parameters=RetargetParameters)
