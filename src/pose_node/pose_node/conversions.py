"""Stamps: integer nanoseconds inside, ``builtin_interfaces/Time`` on the wire."""

from builtin_interfaces.msg import Time

from pose_core.stamps import NS_PER_S


def ns_to_stamp(stamp_ns: int) -> Time:
    """A message's stamp from nanoseconds."""
    seconds, rest = divmod(stamp_ns, NS_PER_S)
    return Time(sec=seconds, nanosec=rest)
