"""Finding topics by the endings of their names, in any namespace."""

import re
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from pose_core.errors import InputError
from pose_core.parameters import OTHER_ID
from pose_io.names import BODIES, SKELETON_ARRAY, TF_STATIC, TRUTH_NAMESPACE, skeletons_topic

if TYPE_CHECKING:  # rosbags takes long to load, and nodes use the names only
    from pose_io.bags import BagReader

SENSOR_TOPIC = re.compile(r"(?:^|/)kinect_(?P<name>\w+)/skeletons$")
IMU = "sensor_msgs/msg/Imu"
IN_CAMERA = re.compile(r"(?:^|/)kinect_\w+/")
IMU_TOPIC = re.compile(r"(?:^|/)imu_(?P<name>\w+)/data$")
BODY_TOPIC = re.compile(rf"{BODIES}(?P<body>[^/]+)/(?P<leaf>\w+)$")


def sensor_topics(bag: "BagReader") -> dict[str, str]:
    """Topic of each sensor's skeletons by the sensor's name, in the order of names."""
    return _topics(bag, SENSOR_TOPIC, SKELETON_ARRAY)


def imu_topics(bag: "BagReader") -> dict[str, str]:
    """Topic of each IMU's orientation by body segment, in the order of names."""
    return _topics(bag, IMU_TOPIC, IMU)


def misnamed_imu_topics(
    topics: Collection[str], segments: Collection[str] | None = None
) -> list[str]:
    """Topics of IMUs whose names tell no segment, but for those in cameras.

    Nor are the raw data of an IMU whose orientations are there, too.

    Args:
        topics: Names of the topics of type ``sensor_msgs/Imu``.
        segments: Names of segments; if None, any name is one.
    """
    named = {topic: match["name"] for topic in topics if (match := IMU_TOPIC.search(topic))}
    used = {topic for topic, name in named.items() if segments is None or name in segments}
    known = used | {f"{topic}_raw" for topic in used}
    return [each for each in sorted(topics) if each not in known and not IN_CAMERA.search(each)]


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


def body_topics(bag: "BagReader", leaf: str, namespace: str = "") -> dict[str, str]:
    """Topic ``humans/bodies/<body>/<leaf>`` of each body by its id, in the order of ids.

    Args:
        bag: An open bag.
        leaf: The last part of the name.
        namespace: Namespace of the topics; if empty any but that of a simulation's truth.

    Raises:
        InputError: If several namespaces have a body of the same id.
    """
    found: dict[str, str] = {}
    for topic in sorted(bag.topics):
        match = BODY_TOPIC.search(topic)
        if match is None or match["leaf"] != leaf:
            continue
        theirs = topic[: match.start()]
        if theirs == namespace or (not namespace and theirs != TRUTH_NAMESPACE):
            _add(bag, found, match["body"], topic)
    return dict(sorted(found.items()))


def body_topic(bag: "BagReader", leaf: str, body: str = "", namespace: str = "") -> str | None:
    """The body's topic among :func:`body_topics`; the subject's if none is named."""
    found = body_topics(bag, leaf, namespace)
    if body:
        return found.get(body)
    # Among several persons, the subject is the one not named person_<number>.
    subject = sorted(found, key=lambda name: bool(OTHER_ID.fullmatch(name)))
    return found[subject[0]] if subject else None


def static_transform_topics(bag: "BagReader") -> list[str]:
    """The topics ``tf_static``, but for that of a simulation's truth."""
    found = bag.topics_of_type("tf2_msgs/msg/TFMessage")
    return [t for t in found if t.endswith(TF_STATIC) and not t.startswith(TRUTH_NAMESPACE)]


def _topics(bag: "BagReader", pattern: re.Pattern[str], msgtype: str) -> dict[str, str]:
    named: dict[str, str] = {}
    for topic in sorted(bag.topics_of_type(msgtype)):
        if match := pattern.search(topic):
            _add(bag, named, match["name"], topic)
    return dict(sorted(named.items()))


def _add(bag: "BagReader", named: dict[str, str], name: str, topic: str) -> None:
    if name in named:
        raise InputError(
            f"{bag.path} holds '{name}' twice, as {named[name]} and {topic}: record or "
            "play one of them alone"
        )
    named[name] = topic
