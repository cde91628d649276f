"""A recording that goes on in the next bag, and bags that were cut off anywhere."""

import shutil
from collections import namedtuple

import numpy as np
import pytest
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from pose_core.errors import InputError
from pose_fusion.recording import continued, growing_bag
from pose_fusion.recording.continued import ContinuedRecording
from pose_fusion.recording.parameters import RecorderParameters
from pose_io.bag_repair import examine, repair
from pose_io.bags import open_bag
from pose_io.typestore import make_typestore

STRING = "std_msgs/msg/String"
STORE = make_typestore()
Usage = namedtuple("Usage", "total used free")


def text(value):
    return bytes(STORE.serialize_cdr(STORE.types[STRING](data=value), STRING))


def offered(durability):
    forever = QosTime(0, 0)
    return Qos(
        QosHistory.KEEP_LAST, 10, QosReliability.RELIABLE, durability, forever, forever,
        QosLiveliness.AUTOMATIC, forever, False,
    )  # fmt: skip


@pytest.fixture
def start(tmp_path):
    made = []

    def make(**values):
        settings = RecorderParameters(**{"least_free_space": 0.0, **values})
        row = ContinuedRecording(tmp_path / "bag", settings)
        row.add_topic("/count", STRING, [offered(QosDurability.VOLATILE)])
        row.add_topic("/tf_static", STRING, [offered(QosDurability.TRANSIENT_LOCAL)])
        made.append(row)
        return row

    yield make
    for row in made:
        row.close()


@pytest.fixture
def clock(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(continued.time, "monotonic", lambda: now[0])
    return now


def read(path, topic="/count"):
    with open_bag(path) as bag:
        return [bag.deserialize(message).data for message in bag.messages([topic])]


def test_a_bag_is_split_by_duration(start, clock, tmp_path):
    row = start(split_duration=10.0)
    row.write("/tf_static", text("places"), 1)
    row.write("/count", text("a"), 2)
    row.flush()
    clock[0] = 11.0
    row.write("/count", text("b"), 3)
    row.flush()
    row.write("/count", text("c"), 4)
    row.close()

    assert read(tmp_path / "bag") == ["a", "b"]
    assert read(tmp_path / "bag-2") == ["c"]
    assert read(tmp_path / "bag-2", "/tf_static") == ["places"]
    assert row.message_count == 5


def test_a_topic_that_is_refused_does_not_end_the_recording_at_its_next_bag(start, tmp_path):
    row = start(split_size=0.001)
    with pytest.raises(InputError, match="package 'nobodys_msgs' is not installed"):
        row.add_topic("/strange", "nobodys_msgs/msg/Strange", [])
    for value in ("x" * 3000, "b"):
        row.write("/count", text(value), 1)
        row.flush()
    row.close()
    assert read(tmp_path / "bag-2") == ["b"]


def test_a_bag_is_split_by_size(start, tmp_path):
    row = start(split_size=0.01)
    for _ in range(3):
        for _ in range(4):
            row.write("/count", text("x" * 3000), 1)
        row.flush()
    row.close()

    assert [len(read(tmp_path / name)) for name in ("bag", "bag-2", "bag-3")] == [4, 4, 4]


def test_a_series_goes_on_with_its_next_number(start, tmp_path):
    for name in ("bag", "bag-2"):
        (tmp_path / name).mkdir()
    row = start(split_size=0.001)
    for _ in range(2):
        row.write("/count", text("x" * 3000), 1)
        row.flush()
    row.close()

    assert [len(read(tmp_path / name)) for name in ("bag-3", "bag-4")] == [1, 1]


def test_recorders_that_begin_at_the_same_moment_have_bags_of_their_own(
    start, tmp_path, monkeypatch
):
    free = iter([tmp_path / "bag", tmp_path / "bag", tmp_path / "bag-2"])
    monkeypatch.setattr(continued, "free_path", lambda _first: next(free))

    assert [start().bag.path.name, start().bag.path.name] == ["bag", "bag-2"]


def test_recording_resumes_in_a_new_bag_once_the_disk_has_space(
    start, clock, tmp_path, monkeypatch
):
    row = start(least_free_space=1.0)
    free = [10**9]
    usage = lambda _path: Usage(10**10, 0, free[0])  # noqa: E731
    monkeypatch.setattr(growing_bag.shutil, "disk_usage", usage)
    row.write("/count", text("a"), 1)
    free[0] = 10
    row.flush()
    assert "only 0 MB are free" in row.trouble
    row.write("/count", text("lost"), 2)
    clock[0] += 5.0
    row.flush()
    assert row.trouble
    free[0] = 10**9
    clock[0] += 5.0
    row.flush()
    assert row.trouble == ""
    row.write("/count", text("b"), 3)
    row.close()

    assert read(tmp_path / "bag") == ["a"]
    assert read(tmp_path / "bag-2") == ["b"]


def test_a_deleted_folder_is_created_again(start, clock, tmp_path):
    row = start()
    row.write("/count", text("a"), 1)
    shutil.rmtree(tmp_path / "bag")
    row.flush()
    assert "No such file" in row.trouble
    clock[0] += 5.0
    row.flush()
    assert row.trouble == ""
    row.write("/count", text("b"), 2)
    row.close()

    assert read(row.bag.path) == ["b"]


def test_a_next_bag_that_cannot_be_made_is_tried_again_and_no_message_counted_twice(
    start, clock, tmp_path, monkeypatch
):
    row = start(split_duration=10.0)
    row.write("/count", text("a"), 1)
    read_only = InputError(f"cannot write {tmp_path}: Read-only file system")

    def refuse():
        raise read_only

    with monkeypatch.context() as patch:
        patch.setattr(row, "_begin", refuse)
        for _ in range(3):
            clock[0] += 11.0
            row.flush()
            assert row.trouble == str(read_only)
            assert row.message_count == 1
    clock[0] += 11.0
    row.flush()
    assert row.trouble == ""
    row.write("/count", text("b"), 2)
    row.close()

    assert row.message_count == row.bags == 2
    assert [read(tmp_path / name) for name in ("bag", "bag-2")] == [["a"], ["b"]]


def test_a_bag_cut_at_any_byte_keeps_all_flushed_messages(start, tmp_path):
    row = start()
    file = tmp_path / "bag" / "bag.mcap"
    flushed = []  # bytes of the file, messages until then
    for k in range(40):
        row.write("/count", text(str(k)), k + 1)
        if k % 10 == 9:
            row.flush()
            flushed.append((file.stat().st_size, k + 1))
    content = file.read_bytes()
    cuts = np.random.default_rng(3).integers(0, len(content), 60).tolist()
    for number, cut in enumerate([*cuts, flushed[0][0], len(content) - 1]):
        path = tmp_path / f"cut-{number}.mcap"
        path.write_bytes(content[:cut])
        # The end that a flush writes is overwritten by the next messages.
        least = max((n for size, n in flushed if size <= cut), default=0)
        try:
            repair(path, examine(path), tmp_path / f"mended-{number}")
            found = read(tmp_path / f"mended-{number}")
        except InputError:
            found = []

        assert found == [str(k) for k in range(len(found))]
        assert len(found) >= least, f"cut at {cut} of {len(content)}"
