"""Stamps of messages, whole and serialised."""

import pytest

from pose_core.stamps import nanoseconds, serialized_ns
from pose_io.typestore import make_typestore

TYPESTORE = make_typestore()


@pytest.mark.parametrize(("sec", "nanosec"), [(0, 0), (1, 999_999_999), (1_763_697_600, 16)])
def test_a_message_and_its_bytes_have_the_same_stamp(sec, nanosec):
    stamp = TYPESTORE.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    header = TYPESTORE.types["std_msgs/msg/Header"](stamp=stamp, frame_id="map")

    data = bytes(TYPESTORE.serialize_cdr(header, "std_msgs/msg/Header"))

    assert nanoseconds(stamp) == sec * 10**9 + nanosec
    assert serialized_ns(data) == nanoseconds(stamp)
