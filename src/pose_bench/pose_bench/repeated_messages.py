"""Serialised messages of a recording that is repeated with stamps that go on."""

from pose_bench.replayed_person import SESSION_S
from pose_core.stamps import CDR_STAMP, CDR_STAMP_AT, NS_PER_S, serialized_ns
from pose_sim.captured.session import START_NS

LOOP_NS = round((SESSION_S + 2.0) * NS_PER_S)  # [ns] a recording and two seconds of an empty room
VISITOR = b"visitor0"  # replaced by another id of this length at each visit


def shifted_by(data: bytes, shift_ns: int) -> bytes:
    """A serialised message with its stamps, which are all equal, shifted."""
    own = data[CDR_STAMP_AT : CDR_STAMP_AT + CDR_STAMP.size]
    later = divmod(serialized_ns(data) + shift_ns, NS_PER_S)
    return data.replace(own, CDR_STAMP.pack(*later))


def in_loop(data: bytes, begin_ns: int, visit: int = 0) -> bytes:
    """A message in a loop that starts at ``begin_ns``, with a visitor's id of this visit."""
    return shifted_by(data, begin_ns - START_NS).replace(VISITOR, b"%08d" % visit)
