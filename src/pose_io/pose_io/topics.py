"""Finding topics by the endings of their names, in any namespace."""

import re
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from pose_core.errors import InputError
from pose_io.names import BODIES, SKELETON_ARRAY, skeletons_topic

if TYPE_CHECKING:  # rosbags takes long to load, and nodes use the names only
    from pose_io.bags import BagReader

SENSOR_TOPIC = re.compile(r"(?:^|/)kinect_(?P<name>\w+)/skeletons$")
IMU_TOPIC = re.compile(r"(?:^|/)imu_(?P<name>\w+)/data$")
OTHER_BODY = re.compile(rf"{BODIES}person_\d+/")


def sensor_topics(bag: "BagReader") -> dict[str, str]:
    """Topic of each sensor's skeletons by the sensor's name, in the order of names."""
    return _topics(bag, SENSOR_TOPIC, SKELETON_ARRAY)


def imu_topics(bag: "BagReader") -> dict[str, str]:
    """Topic of each IMU's orientation by body segment, in the order of names."""
    return _topics(bag, IMU_TOPIC, "sensor_msgs/msg/Imu")


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


def body_topic(bag: "BagReader", leaf: str, body: str = "", namespace: str = "") -> str | None:
    """The topic ``<namespace>/humans/bodies/<body>/<leaf>``; the subject's if none is named."""
    pattern = re.compile(rf"^{re.escape(namespace)}{BODIES}{re.escape(body) or '[^/]+'}/{leaf}$")
    found = [name for name in sorted(bag.topics) if pattern.match(name)]
    # Among several persons, the subject is the one not named person_<number>.
    return next(iter(sorted(found, key=lambda name: bool(OTHER_BODY.search(name)))), None)


def _topics(bag: "BagReader", pattern: re.Pattern[str], msgtype: str) -> dict[str, str]:
    matches = {topic: pattern.search(topic) for topic in sorted(bag.topics_of_type(msgtype))}
    named: dict[str, str] = {}
    for topic, match in matches.items():
        if match is None:
            continue
        name = match["name"]
        if name in named:
            raise InputError(
                f"{bag.path} holds '{name}' twice, as {named[name]} and {topic}: record or "
                "play one of them alone"
            )
        named[name] = topic
    return dict(sorted(named.items()))
