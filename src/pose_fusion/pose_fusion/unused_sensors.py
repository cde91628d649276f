"""Detection of cameras that publish but are not among the used sensors."""

from collections.abc import Collection, Iterable

from pose_io.names import SKELETON_ARRAY, skeletons_topic
from pose_io.topics import SENSOR_TOPIC


def unused_sensors(
    topics: Iterable[tuple[str, Collection[str]]], used: Collection[str], namespace: str
) -> tuple[str, ...]:
    """Names of sensors that publish skeletons but are not used.

    Args:
        topics: Names and types of the topics of the graph.
        used: The sensors that are used.
        namespace: Namespace of their topics, ``/`` for none.
    """
    found = set()
    for topic, types in topics:
        match = SENSOR_TOPIC.search(topic)
        if match is None or SKELETON_ARRAY not in types:
            continue
        if topic == f"{namespace.rstrip('/')}/{skeletons_topic(match['name'])}":
            found.add(match["name"])
    return tuple(sorted(found - set(used)))
