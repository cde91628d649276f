"""The growing bag behind the recorder."""

import os
import shutil
import sqlite3
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import Reader

from pose_core.errors import InputError
from pose_fusion.recording import growing_bag
from pose_fusion.recording.growing_bag import GrowingBag, RecordingError
from pose_io.bags import open_bag
from pose_io.typestore import make_typestore

STORAGES = ("mcap", "sqlite3")
FOREVER = QosTime(9223372036, 854775807)
LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    FOREVER,
    FOREVER,
    QosLiveliness.AUTOMATIC,
    FOREVER,
    False,
)


@pytest.fixture(scope="module")
def data():
    store = make_typestore()
    text = store.types["std_msgs/msg/String"]
    return [
        bytes(store.serialize_cdr(text(f"message {index}"), "std_msgs/msg/String"))
        for index in range(100)
    ]


def start(path, storage="mcap", **options):
    recording = GrowingBag(path, storage, **options)
    recording.add_topic("/greeting", "std_msgs/msg/String", [LATCHED])
    return recording


def read(path):
    with open_bag(path) as bag:
        return [(message.stamp_ns, message.data) for message in bag.messages()]


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_holds_the_original_bytes_and_stamps(tmp_path, data, storage):
    recording = start(tmp_path / "bag", storage)
    for index, datum in enumerate(data):
        recording.write("/greeting", datum, 1_000 + index)
    recording.close()

    assert read(tmp_path / "bag") == [(1_000 + i, datum) for i, datum in enumerate(data)]
    assert recording.counts == {"/greeting": 100}


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_contains_its_message_definitions_and_qos(tmp_path, storage):
    recording = GrowingBag(tmp_path / "bag", storage)
    recording.add_topic("/kinect_left/skeletons", "pose_msgs/msg/SkeletonArray", [LATCHED])
    store = make_typestore()
    array = store.types["pose_msgs/msg/SkeletonArray"]
    header = store.types["std_msgs/msg/Header"](
        stamp=store.types["builtin_interfaces/msg/Time"](sec=3, nanosec=4), frame_id="f"
    )
    written = array(header=header, skeletons=[])
    recording.write("/kinect_left/skeletons", store.serialize_cdr(written, array.__msgtype__), 5)
    recording.close()

    with AnyReader([tmp_path / "bag"]) as reader:
        ((connection, stamp_ns, raw),) = reader.messages()
        message = reader.deserialize(raw, connection.msgtype)
    assert stamp_ns == 5
    assert message.header.stamp.nanosec == 4
    with Reader(tmp_path / "bag") as reader:
        assert reader.connections[0].ext.offered_qos_profiles == [LATCHED]


def test_an_mcap_file_is_complete_after_every_flush(tmp_path, data):
    recording = start(tmp_path / "bag")
    for round_ in range(3):
        for datum in data:
            recording.write("/greeting", datum, 1 + round_)
        recording.flush()
        copy = tmp_path / f"copy{round_}.mcap"
        shutil.copy(tmp_path / "bag" / "bag.mcap", copy)

        assert len(read(copy)) == 100 * (round_ + 1)
    recording.close()


def test_large_messages_do_not_disturb_the_flushes(tmp_path):
    store = make_typestore()
    text = store.types["std_msgs/msg/String"]
    large = bytes(store.serialize_cdr(text("x" * 3_000_000), "std_msgs/msg/String"))
    recording = start(tmp_path / "bag")
    for index in range(3):
        recording.write("/greeting", large, index)
        recording.flush()
    recording.close()

    assert [stamp for stamp, _ in read(tmp_path / "bag")] == [0, 1, 2]


def test_an_empty_recording_leaves_no_file(tmp_path):
    start(tmp_path / "bag").close()

    assert not (tmp_path / "bag").exists()


def test_an_existing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="exists already"):
        GrowingBag(tmp_path)


def test_a_folder_that_cannot_be_created_is_refused(tmp_path):
    (tmp_path / "file").touch()

    with pytest.raises(InputError, match="cannot write"):
        GrowingBag(tmp_path / "file" / "bag")


@pytest.mark.parametrize(
    ("storage", "error"),
    [
        ("mcap", OSError(28, "No space left on device")),
        ("sqlite3", sqlite3.OperationalError("database or disk is full")),
    ],
)
def test_a_disk_without_room_for_a_bag_s_beginning_is_one_line_and_leaves_nothing(
    tmp_path, storage, error, monkeypatch
):
    path = tmp_path / "bag"

    def refuse(_writer):
        path.mkdir()
        (path / "part").touch()
        raise error

    monkeypatch.setattr(growing_bag.Writer, "open", refuse)
    with pytest.raises(InputError, match=r"cannot write .*bag: (No space|database or disk)"):
        GrowingBag(path, storage)
    assert not path.exists()


def test_an_unknown_type_is_refused(tmp_path):
    recording = GrowingBag(tmp_path / "bag")

    with pytest.raises(InputError, match="no_such_msgs"):
        recording.add_topic("/x", "no_such_msgs/msg/Thing", [])


def test_a_nearly_full_disk_ends_the_recording_with_a_complete_bag(tmp_path, data):
    recording = start(tmp_path / "bag", least_free=2**62)
    recording.write("/greeting", data[0], 1)

    with pytest.raises(RecordingError, match="complete, with 1 messages; make room"):
        recording.flush()

    assert read(tmp_path / "bag") == [(1, data[0])]


class FullDisk:
    """A file that takes only part of what is written to it."""

    def __init__(self, file):
        self._file = file

    def __getattr__(self, name):
        return getattr(self._file, name)

    def write(self, data):
        self._file.write(bytes(data)[: len(data) // 2])
        raise OSError(28, os.strerror(28))


def test_after_a_write_error_the_flushed_messages_can_be_read(tmp_path, data):
    recording = start(tmp_path / "bag")
    for datum in data[:60]:
        recording.write("/greeting", datum, 1)
    recording.flush()
    recording.write("/greeting", data[60], 2)
    storage = recording._writer.storage
    storage.bio = FullDisk(storage.bio)

    with pytest.raises(RecordingError, match=r"No space left on device; the first 60 messages"):
        recording.flush()

    assert read(tmp_path / "bag") == [(1, datum) for datum in data[:60]]
    recording.close()  # changes nothing any more
    assert len(read(tmp_path / "bag")) == 60


def test_an_early_write_error_leaves_no_file(tmp_path, data):
    recording = start(tmp_path / "bag")
    recording.write("/greeting", data[0], 2)
    storage = recording._writer.storage
    storage.bio = FullDisk(storage.bio)

    with pytest.raises(RecordingError, match="nothing was saved"):
        recording.close()

    assert list(Path(tmp_path).iterdir()) == []
