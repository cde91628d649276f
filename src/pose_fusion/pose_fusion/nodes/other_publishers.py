"""Topics that a node publishes although another one does."""

from collections.abc import Iterable

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log, ParameterEvent
from rclpy.node import Node
from rclpy.publisher import Publisher
from tf2_msgs.msg import TFMessage

MANY_PUBLISH = (TFMessage, DiagnosticArray, Log, ParameterEvent)  # in any graph


def warn_of_others(node: Node, publishers: Iterable[Publisher], remedy: str) -> str:
    """Warning that names the topics which others publish, too; empty: there are none."""
    shared = [
        publisher.topic_name
        for publisher in publishers
        if publisher.msg_type not in MANY_PUBLISH
        and node.count_publishers(publisher.topic_name) > 1
    ]
    return f"others publish too: {', '.join(shared)}; {remedy}" if shared else ""
