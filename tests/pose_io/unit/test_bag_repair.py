"""Repair of bags whose recording was interrupted."""

import shutil

import numpy as np
import pytest

from pose_core.errors import InputError
from pose_fusion.recording.growing_bag import GrowingBag
from pose_fusion.tools.doctor import doctor_bag
from pose_io.bag_repair import END, examine, repair
from pose_io.bags import open_bag
from pose_io.typestore import make_typestore

STRING = "std_msgs/msg/String"
STEP_NS = 10_000_000


def cut_off(path, stamps_ns, storage="mcap"):
    """A recording of which only what was flushed is on disk, in takes of ten messages."""
    store = make_typestore()
    recording = GrowingBag(path, storage)
    recording.add_topic("/text", STRING, [])
    for index, stamp_ns in enumerate(stamps_ns):
        data = store.serialize_cdr(store.types[STRING](f"text {index}"), STRING)
        recording.write("/text", bytes(data), int(stamp_ns))
        if index % 10 == 9:
            recording.flush()
    copy = path.with_name(f"{path.name}-cut")
    shutil.copytree(path, copy)
    recording.close()
    return copy


@pytest.fixture
def stamps_ns():
    """Two topics' worth of stamps, taken in another order than they came."""
    stamps_ns = 10**9 + STEP_NS * np.arange(50)
    stamps_ns[[8, 12]] = stamps_ns[[12, 8]]  # from one take into the next
    return stamps_ns


def test_messages_of_a_cut_off_recording_are_read_in_the_order_of_their_stamps(tmp_path, stamps_ns):
    with open_bag(cut_off(tmp_path / "bag", stamps_ns)) as bag:
        read = [message.stamp_ns for message in bag.messages()]

    assert read == sorted(stamps_ns.tolist())


def test_an_interrupted_recording_is_reported_without_index_and_repaired(
    tmp_path, stamps_ns, capsys
):
    bag = cut_off(tmp_path / "bag", stamps_ns)

    assert doctor_bag(bag, None) == 1
    said = capsys.readouterr().out
    assert "has no index" in said
    assert "has no metadata.yaml" in said
    assert doctor_bag(bag, tmp_path / "mended") == 0
    assert "1 topics, 50 messages" in capsys.readouterr().out
    assert doctor_bag(tmp_path / "mended", None) == 0


@pytest.mark.parametrize("cut", [1, 40, 200, 1000])
def test_a_file_that_ends_anywhere_is_saved_up_to_its_last_whole_chunk(tmp_path, stamps_ns, cut):
    bag = cut_off(tmp_path / "bag", stamps_ns)
    (file,) = bag.glob("*.mcap")
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) - len(END) - cut])
    before = file.read_bytes()

    with pytest.raises(InputError, match=r"\./pose doctor"):
        open_bag(bag)
    condition = examine(file)
    count = repair(file, condition, tmp_path / "mended")

    assert not condition.ends
    assert count % 10 == 0
    assert 0 < count < 50 or cut < 200
    assert file.read_bytes() == before
    with open_bag(tmp_path / "mended") as mended:
        assert mended.message_count == count
        assert mended.topics["/text"].msgtype == STRING


def test_zeros_after_a_power_cut_are_left_out(tmp_path, stamps_ns):
    bag = cut_off(tmp_path / "bag", stamps_ns)
    (file,) = bag.glob("*.mcap")
    whole = file.read_bytes()
    file.write_bytes(whole[: -len(END)] + bytes(5000))

    condition = examine(file)

    assert condition.problem == "bytes that are not a record"
    assert repair(file, condition, tmp_path / "mended") == 50


def test_a_whole_bag_needs_no_mending(tmp_path, stamps_ns, capsys):
    cut_off(tmp_path / "bag", stamps_ns)

    assert doctor_bag(tmp_path / "bag", None) == 0
    assert "1 topics, 50 messages, 0.5 s, whole" in capsys.readouterr().out


def test_what_is_no_mcap_file_is_refused(tmp_path):
    (tmp_path / "x.mcap").write_bytes(b"something else")

    with pytest.raises(InputError, match="there is nothing to repair"):
        doctor_bag(tmp_path / "x.mcap", None)
    with pytest.raises(InputError, match="found no bag at"):
        doctor_bag(tmp_path / "y", None)


def test_a_cut_off_database_is_read_without_its_metadata(tmp_path, stamps_ns):
    with open_bag(cut_off(tmp_path / "bag", stamps_ns, "sqlite3")) as bag:
        assert bag.message_count == 50


def test_for_a_database_doctor_has_the_command_that_makes_its_metadata(tmp_path, stamps_ns):
    with pytest.raises(InputError, match=r"of a \.db3 file, 'ros2 bag reindex'"):
        doctor_bag(cut_off(tmp_path / "bag", stamps_ns, "sqlite3"), None)


def test_a_split_bag_without_metadata_is_refused_with_instructions(tmp_path):
    for part in range(2):
        (tmp_path / f"bag_{part}.db3").write_bytes(b"")
    with pytest.raises(InputError, match=r"and 2 .mcap or .db3 files .*'ros2 bag reindex' makes"):
        open_bag(tmp_path)


def test_a_bag_with_a_truncated_index_loses_no_message(tmp_path, stamps_ns, capsys):
    cut_off(tmp_path / "bag", stamps_ns)
    (file,) = (tmp_path / "bag").glob("*.mcap")
    file.write_bytes(file.read_bytes()[:-100])

    assert doctor_bag(tmp_path / "bag", None) == 1
    assert "a truncated index: no message is lost" in capsys.readouterr().out
    assert repair(file, examine(file), tmp_path / "mended") == 50
