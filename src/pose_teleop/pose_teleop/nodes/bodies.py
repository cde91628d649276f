"""Topics of a person: their names, and the QoS of subscriptions and publishers."""

from pose_node.nodes.qos import latched, reliable

NEWEST, LATCHED = reliable(1), latched(1)


def body_topic(body: str, name: str) -> str:
    """A topic of a body; relative, so that a namespace applies to it."""
    return f"humans/bodies/{body}/{name}"
