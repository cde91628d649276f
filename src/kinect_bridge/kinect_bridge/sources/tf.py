"""``tf``: a tracker that publishes each joint as a frame on ``/tf``.

A joint's frame is named after the joint and the person, ``{joint}_{person}`` unless
``tf_frames`` is set; joints are those of the joint map. The transforms of one instant may be in one
message or in several: a frame is complete when all persons' joints have been received, or when
one is received again.
"""

import re
from dataclasses import replace
from typing import Any

import numpy as np

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.live import MAX_PEOPLE, Person
from kinect_bridge.sources.topic_source import TopicSource
from pose_core.arrays import FloatArray
from pose_core.errors import ParameterError
from pose_core.stamps import nanoseconds
from pose_io.names import TF_STATIC

MAX_FRAMES = 4096  # largest number of stored frames
MAX_DEPTH = 32  # largest number of transforms from a joint to the root
JOINT, PERSON = "{joint}", "{person}"


Parents = dict[str, tuple[str, FloatArray, FloatArray]]
"""Each frame's parent, and its pose there: quaternion x, y, z, w, and translation [m]."""


def place_in(root: str, frame: str, parents: Parents) -> FloatArray:
    """Position of the frame's origin in the root [m], (3,); NaN if they are not connected."""
    point = np.zeros(3)
    for _ in range(MAX_DEPTH):
        if frame == root:
            return point
        if frame not in parents:
            break
        frame, rotation, translation = parents[frame]
        point = rotate(rotation, point) + translation
    return np.full(3, np.nan)


def rotate(quaternion: FloatArray, point: FloatArray) -> FloatArray:
    """Rotate a point by a quaternion x, y, z, w of any norm but 0."""
    axis, real = quaternion[:3], quaternion[3]
    twice = 2.0 * np.cross(axis, point) / (quaternion @ quaternion)
    return np.asarray(point + real * twice + np.cross(axis, twice))


class TfSource(TopicSource):
    """Source of persons as frames on ``/tf``."""

    NAME, TOPIC, JOINT_MAP = "tf", "/tf", "openni_tf"
    TYPE = "tf2_msgs/msg/TFMessage"
    COUNTERS = ("transforms_not_finite", "transforms_beyond_limit", "cycles_incomplete")

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        super().__init__(parameters)
        static = replace(self.topics[0], name=TF_STATIC, latched=True)
        self.topics = tuple(replace(topic, depth=100) for topic in (*self.topics, static))
        self._template = parameters.tf_frames
        self._pattern = _pattern(parameters.tf_frames)
        self._root = parameters.tf_root
        self._parents: Parents = {}
        self._cycle: dict[str, dict[int, str]] = {}  # the joints' frames of each person
        self._stamp_ns = 0
        self._people: frozenset[str] = frozenset()  # of the previous cycle

    def receive(self, message: Any, topic: str) -> None:
        """Store transforms; a complete cycle is one frame."""
        if len(message.transforms) > MAX_FRAMES:
            self.counters.add("transforms_beyond_limit", len(message.transforms))
            return
        for transform in message.transforms:
            self._take(transform)
        if self._is_complete():
            self._flush()

    def waits_for(self) -> str:
        """Description of the expected frames."""
        frame = self._template.replace(JOINT, self.joint_map.joints[0]).replace(PERSON, "1")
        return f"frames such as '{frame}' on {self.hardware_id}"

    def _take(self, transform: Any) -> None:
        r, t = transform.transform.rotation, transform.transform.translation
        rotation, translation = np.array([r.x, r.y, r.z, r.w]), np.array([t.x, t.y, t.z])
        if not np.isfinite(translation).all() or not 0.0 < rotation @ rotation < np.inf:
            self.counters.add("transforms_not_finite")
            return
        child, parent = transform.child_frame_id, transform.header.frame_id
        found = self._joint(child)
        if found is not None and found[1] in self._cycle.get(found[0], {}):
            self.counters.add("cycles_incomplete", not self._is_complete())
            self._flush()
        if child not in self._parents and len(self._parents) >= MAX_FRAMES:
            self.counters.add("transforms_beyond_limit")
            return
        self._parents[child] = (parent, rotation, translation)
        if found is None:
            return
        person, joint = found
        if person not in self._cycle and len(self._cycle) >= MAX_PEOPLE:
            self.counters.add("people_beyond_limit")
            return
        self._cycle.setdefault(person, {})[joint] = child
        self._stamp_ns = max(self._stamp_ns, nanoseconds(transform.header.stamp))

    def _joint(self, frame: str) -> tuple[str, int] | None:
        """The person and joint index of a frame, None if it is not a joint's."""
        match = self._pattern.fullmatch(frame)
        if match is None:
            return None
        joint = self.joint_map.index.get(match["joint"])
        return None if joint is None else (match.groupdict().get("person", "0"), joint)

    def _is_complete(self) -> bool:
        count = len(self.joint_map.joints)
        full = bool(self._cycle) and all(len(each) == count for each in self._cycle.values())
        return full and self._people <= set(self._cycle)

    def _flush(self) -> None:
        """Push the cycle as a frame and start the next."""
        cycle, self._cycle = self._cycle, {}
        stamp_ns, self._stamp_ns = self._stamp_ns, 0
        self._people = frozenset(cycle)
        self.push([self._person(name, frames) for name, frames in cycle.items()], stamp_ns or None)

    def _person(self, name: str, frames: dict[int, str]) -> Person:
        root = self._root or self._find_root(next(iter(frames.values())))
        positions = self.no_places()
        for joint, frame in frames.items():
            positions[joint] = place_in(root, frame, self._parents)
        return Person(id=name, positions=positions)

    def _find_root(self, frame: str) -> str:
        """The first ancestor of a joint's frame that is not a joint's."""
        for _ in range(MAX_DEPTH):
            if self._joint(frame) is None:
                break
            frame = self._parents[frame][0] if frame in self._parents else ""
        return frame


def _pattern(template: str) -> re.Pattern[str]:
    if template.count(JOINT) != 1 or template.count(PERSON) > 1:
        raise ParameterError(
            f"tf_frames = {template!r}: expected {JOINT} once and {PERSON} at most once, for "
            f"example '{JOINT}_{PERSON}'"
        )
    escaped = re.escape(template)
    escaped = escaped.replace(re.escape(JOINT), r"(?P<joint>.+)")
    return re.compile(escaped.replace(re.escape(PERSON), r"(?P<person>\w+)"), re.ASCII)
