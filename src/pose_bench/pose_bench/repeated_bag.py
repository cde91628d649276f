"""A long bag from a short one: what the sensors said, again and again."""

import struct
from pathlib import Path

from pose_core.stamps import NS_PER_S
from pose_io.bag_writer import BagWriter
from pose_io.bags import BagReader
from pose_io.topics import imu_topics, sensor_topics

PAUSE_NS = 33_333_333  # [ns] between the end and the next beginning
STAMP = struct.Struct("<iI")
STAMP_AT = 4  # [bytes] a message's own stamp comes first, after the encapsulation


def repeat(bag: BagReader, path: Path, times: int, *, imus: bool = True) -> float:
    """Write a bag of the sensors' messages and the static transforms; its length [s].

    Args:
        bag: Of at most some minutes: its messages are kept meanwhile.
        path: The bag to make.
        times: How often it is played.
        imus: The IMUs' too.
    """
    topics = [*sensor_topics(bag).values(), *(imu_topics(bag).values() if imus else ())]
    messages = [entry for batch in bag.batches(topics) for entry in batch]
    first_ns, last_ns = messages[0][1], messages[-1][1]
    period_ns = last_ns - first_ns + PAUSE_NS
    with BagWriter(path) as writer:
        writer.add_topic("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
        for message in list(bag.messages(["/tf_static"]))[-1:]:
            writer.write_serialized(message.topic, message.msgtype, message.data, first_ns)
        for turn in range(times):
            shift_ns = turn * period_ns
            for connection, stamp_ns, data in messages:
                shifted = shifted_by(data, shift_ns)
                writer.write_serialized(
                    connection.topic, connection.msgtype, shifted, stamp_ns + shift_ns
                )
    return times * period_ns / NS_PER_S


def shifted_by(data: bytes, shift_ns: int) -> bytes:
    """A message whose own stamps, all alike, are later."""
    own = data[STAMP_AT : STAMP_AT + STAMP.size]
    seconds, nanoseconds = STAMP.unpack(own)
    later = divmod(seconds * NS_PER_S + nanoseconds + shift_ns, NS_PER_S)
    return data.replace(own, STAMP.pack(*later))
