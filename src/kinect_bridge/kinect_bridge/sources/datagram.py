"""The datagrams of ``udp``: one frame each, JSON or MessagePack; see docs/udp.md."""

from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from kinect_bridge.sources.live import MAX_ID, MAX_PEOPLE, Person
from pose_io.recordings.joint_maps import JointMap

VERSION = 1
MAX_BYTES = 32_768
MAX_JOINTS = 128
JSON_BEGINS = (b"{", b" ", b"\n", b"\r", b"\t")

Joint = Annotated[list[float | None], Meta(min_length=3, max_length=4)]  # x, y, z, confidence
Joints = Annotated[list[Joint | None], Meta(max_length=MAX_JOINTS)]
NamedJoints = Annotated[dict[str, Joint | None], Meta(max_length=MAX_JOINTS)]


class PersonData(msgspec.Struct):
    """One person of a datagram."""

    id: Annotated[str, Meta(min_length=1, max_length=MAX_ID)] | int
    joints: Joints | NamedJoints


class Datagram(msgspec.Struct):
    """One frame."""

    v: int
    seq: Annotated[int, Meta(ge=0, lt=2**32)]
    time_ns: Annotated[int, Meta(ge=0, lt=2**62)]
    people: Annotated[list[PersonData], Meta(max_length=4 * MAX_PEOPLE)]


_JSON = msgspec.json.Decoder(Datagram)
_MSGPACK = msgspec.msgpack.Decoder(Datagram)


def decode(data: bytes) -> Datagram:
    """Read a datagram.

    Raises:
        msgspec.DecodeError: If it is neither JSON nor MessagePack, or not a valid datagram.
    """
    try:
        return (_JSON if data.startswith(JSON_BEGINS) else _MSGPACK).decode(data)
    except (UnicodeDecodeError, RecursionError) as error:
        raise msgspec.DecodeError(str(error)) from error


def to_person(person: PersonData, joint_map: JointMap) -> Person:
    """Convert a person of a datagram; joints in the order of the map.

    Raises:
        KeyError: If a joint's name is not in the map.
    """
    joints: list[list[float | None] | None] = []
    if isinstance(person.joints, dict):
        joints = [None] * len(joint_map.joints)
        for name, joint in person.joints.items():
            joints[joint_map.index[name]] = joint
    else:
        joints = list(person.joints)
    values = np.array([_four(joint) for joint in joints], dtype=np.float64).reshape(-1, 4)
    # Infinite confidences count as missing, too.
    confidence = np.where(np.isfinite(values[:, 3]), values[:, 3], np.nan)
    return Person(id=str(person.id), positions=values[:, :3], confidence=confidence)


def _four(joint: list[float | None] | None) -> list[float]:
    """x, y, z and confidence; NaN for each that is missing."""
    numbers = [np.nan if value is None else value for value in joint or []]
    return numbers + [np.nan] * (4 - len(numbers))
