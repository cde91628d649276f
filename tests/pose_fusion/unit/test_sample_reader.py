"""IMUs' messages are read in order, and the unusable ones counted."""

import numpy as np

from pose_core.counters import Counters
from pose_core.streams.stamp_check import StampCheck
from pose_fusion.sample_reader import COUNTS, SampleReader, read_imus
from pose_io.message_maker import MessageMaker
from pose_io.typestore import make_typestore

TYPESTORE = make_typestore()
MAKE = MessageMaker(TYPESTORE)
S = 10**9
MS = 10**6


def imu(stamp_ns, quaternion=(0.0, 0.0, 0.0, 1.0)):
    message = MAKE.imu(MAKE.header(stamp_ns), np.array(quaternion), np.ones(3), np.zeros(3))
    return bytes(TYPESTORE.serialize_cdr(message, message.__msgtype__))


def test_samples_of_several_imus_are_in_the_order_of_their_stamps():
    datas = {"torso": [imu(S + 3), imu(S + 1)], "head": [imu(S + 2), imu(S + 1)]}
    block = read_imus(datas, Counters("imu_without_orientation"))
    assert block.stamps_ns.tolist() == [S + 1, S + 1, S + 2, S + 3]
    assert [block.segments[i] for i in block.imu] == ["torso", "head", "head", "torso"]


def test_messages_without_an_orientation_are_counted():
    counters = Counters("imu_without_orientation")
    datas = {"torso": [imu(S), imu(S + 1, quaternion=np.zeros(4)), b""], "head": [imu(S)]}
    assert len(read_imus(datas, counters)) == 2
    assert counters["imu_without_orientation"] == 2


def test_imus_whose_messages_all_lack_an_orientation_are_named():
    reader = SampleReader(["left"], StampCheck(), Counters(*COUNTS))
    mute = imu(S, quaternion=np.zeros(4))
    reader.imus({"torso": [mute, imu(S)], "head": [mute]}, S, {})
    assert reader.oriented == {"torso": True, "head": False}
    reader.imus({"torso": [mute], "head": [imu(2 * S)]}, 2 * S, {})
    assert reader.oriented == {"torso": True, "head": True}


def test_stamps_are_judged_in_the_order_of_arrival():
    counters = Counters(*COUNTS)
    datas = {"torso": [imu(S + 20 * MS), imu(S + 10 * MS), imu(S + 30 * MS)]}
    check = StampCheck()
    block = SampleReader(["left"], check, counters).imus(datas, S + 40 * MS, {})
    assert block.stamps_ns.tolist() == [S + 20 * MS, S + 30 * MS]
    assert check.counters["stamps_backwards"] == 1
    assert counters["imu_without_orientation"] == 0
    block = SampleReader(["left"], None, counters).imus(datas, S + 40 * MS, {})
    assert block.stamps_ns.tolist() == [S + 10 * MS, S + 20 * MS, S + 30 * MS]


def test_samples_that_waited_in_the_queue_are_not_late():
    stamps_ns = S + 10 * MS * np.arange(100)
    reader = SampleReader(["left"], StampCheck(), Counters(*COUNTS))
    mute = imu(S, quaternion=np.zeros(4))
    block = reader.imus({"torso": [mute, *map(imu, stamps_ns)]}, np.append(S, stamps_ns + MS), {})
    assert block.stamps_ns.tolist() == stamps_ns.tolist()
    assert not reader.check.excluded
