"""Serialised messages of packets, made without ROS."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from pose_bench.faults.packets import Frame, Imu, Note, Packet
from pose_core.stamps import NS_PER_S
from pose_io.message_maker import MessageMaker
from pose_io.names import TF_STATIC, imu_topic, sensor_frame, skeletons_topic
from pose_io.typestore import make_typestore

INT32 = np.iinfo(np.int32)
STORE = make_typestore()
MAKE = MessageMaker(STORE)

Planned = tuple[float, str, str, bytes]
"""Time after the start [s], topic, type, and serialised message."""


def planned(packet: Packet) -> Planned:
    """Serialise a packet."""
    topic, message = _message(packet)
    data = packet.raw
    if data is None:
        data = bytes(STORE.serialize_cdr(message, message.__msgtype__))
    if packet.flips:
        turned = bytearray(data)
        for place in packet.flips:
            turned[4 + place % (len(turned) - 4)] ^= 1 << place % 8
        data = bytes(turned)
    return packet.at_s, topic, message.__msgtype__, data[: packet.cut]


def _message(packet: Packet) -> tuple[str, Any]:
    if isinstance(packet, Frame):
        return f"/{skeletons_topic(packet.source)}", _frame(packet)
    if isinstance(packet, Imu):
        return f"/{imu_topic(packet.source.removeprefix('imu/'))}", _imu(packet)
    assert isinstance(packet, Note)
    return NOTES[packet.source](packet)


def _header(stamp_ns: int, frame_id: str = "") -> Any:
    """A header with the stamp, or the nearest one that a message can hold."""
    earliest_ns, latest_ns = INT32.min * NS_PER_S, (INT32.max + 1) * NS_PER_S - 1
    return MAKE.header(min(max(stamp_ns, earliest_ns), latest_ns), frame_id)


def _frame(frame: Frame) -> Any:
    name = sensor_frame(frame.source) if frame.frame_id is None else frame.frame_id
    header = _header(frame.stamp_ns, name)
    people = [MAKE.skeleton(header, p.id, p.positions, p.states) for p in frame.persons]
    named = zip(people, frame.persons, strict=True)
    return MAKE.skeletons(header, [replace(each, name=list(p.names)) for each, p in named])


def _imu(imu: Imu) -> Any:
    header = _header(imu.stamp_ns, "imu")
    message = MAKE.imu(header, imu.orientation, np.zeros(3), imu.rate, imu.acceleration)
    return replace(message, orientation_covariance=np.diag(imu.variances).ravel())


def _static(note: Note) -> tuple[str, Any]:
    if "size" not in note.values:
        return TF_STATIC, MAKE.make("tf2_msgs/TFMessage", transforms=[])
    T_map_sensor = np.eye(4)
    T_map_sensor[:3, 3] = note.values["size"]
    message = MAKE.sensor_transforms({"right": T_map_sensor}, note.stamp_ns)
    if "frames" in note.values:
        (transform,) = message.transforms
        transform.header.frame_id, transform.child_frame_id = note.values["frames"]
    return TF_STATIC, message


def _clock(note: Note) -> tuple[str, Any]:
    offset_ns = round(note.values["offset_ns"])
    return "/clock_offsets", MAKE.make(
        "sensor_msgs/TimeReference",
        header=_header(note.stamp_ns),
        time_ref=_header(note.stamp_ns + offset_ns).stamp,
        source=note.values["source"],
    )


def _status(_note: Note) -> tuple[str, Any]:
    texts = {"name": "noise", "message": "x" * 100, "hardware_id": ""}
    status = MAKE.make("diagnostic_msgs/DiagnosticStatus", level=0, values=[], **texts)
    header = _header(0)
    return "/diagnostics", MAKE.make(
        "diagnostic_msgs/DiagnosticArray", header=header, status=[status]
    )


NOTES: dict[str, Callable[[Note], tuple[str, Any]]] = {
    "tf_static": _static,
    "clock_offsets": _clock,
    "diagnostics": _status,
}
