"""Topics of a person: their names, and the QoS of subscriptions and publishers."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)


def body_topic(body: str, name: str) -> str:
    """A topic of a body; relative, so that a namespace applies to it."""
    return f"humans/bodies/{body}/{name}"
