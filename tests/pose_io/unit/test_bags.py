from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from pose_core.errors import InputError
from pose_io import bags
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.typestore import make_typestore


@pytest.fixture(scope="module")
def typestore():
    return make_typestore()


def skeleton(typestore, person="subject", stamp_ns=0):
    types = typestore.types
    point = types["geometry_msgs/msg/Point"]
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    return types["pose_msgs/msg/Skeleton"](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds),
            frame_id="map",
        ),
        id=person,
        name=["head", "neck"],
        position=[point(x=1.0, y=2.0, z=3.0), point(x=np.nan, y=np.nan, z=np.nan)],
        tracking_state=np.array([2, 0], np.uint8),
    )


def write_bag(path, messages):
    """Write (topic, message, stamp_ns) into a new bag, ordered by stamp, ties as given."""
    with BagWriter(path) as bag:
        for topic, message, stamp_ns in sorted(messages, key=lambda entry: entry[2]):
            bag.write(topic, message, stamp_ns)


def text(typestore, data):
    return typestore.types["std_msgs/msg/String"](data=data)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_what_was_written_is_read_back(tmp_path, typestore, storage):
    with BagWriter(tmp_path / "bag", storage=storage) as bag:
        bag.write("/skeleton", skeleton(typestore, stamp_ns=1_500_000_000), 7)
    with open_bag(tmp_path / "bag") as bag:
        (message,) = bag.messages()
        read = bag.deserialize(message)
    assert (message.topic, message.msgtype, message.stamp_ns) == (
        "/skeleton",
        "pose_msgs/msg/Skeleton",
        7,
    )
    assert (read.header.stamp.sec, read.header.stamp.nanosec) == (1, 500_000_000)
    assert read.position[0].z == 3.0
    assert np.isnan(read.position[1].x)
    assert list(read.tracking_state) == [2, 0]


def test_a_single_mcap_file_opens_too(tmp_path, typestore):
    write_bag(tmp_path / "bag", [("/a", text(typestore, "x"), 1)])
    with open_bag(tmp_path / "bag" / "bag.mcap") as bag:
        assert [message.topic for message in bag.messages()] == ["/a"]


def test_messages_come_in_the_order_of_their_stamps_whatever_the_order_of_writing(
    tmp_path, typestore
):
    with BagWriter(tmp_path / "bag") as bag:
        for stamp_ns in (5, 3, 9, 1):
            bag.write("/a", text(typestore, str(stamp_ns)), stamp_ns)
    with open_bag(tmp_path / "bag") as bag:
        assert [message.stamp_ns for message in bag.messages()] == [1, 3, 5, 9]
        assert (bag.start_ns, bag.end_ns) == (1, 9)


def test_equal_stamps_keep_the_order_of_writing(tmp_path, typestore):
    write_bag(tmp_path / "bag", [("/a", text(typestore, str(i)), 4) for i in range(50)])
    with open_bag(tmp_path / "bag") as bag:
        assert [bag.deserialize(m).data for m in bag.messages()] == [str(i) for i in range(50)]


def test_messages_of_overlapping_chunks_come_as_rosbags_gives_them(tmp_path, typestore):
    rng = np.random.default_rng(1)
    stamps_ns = np.sort(rng.integers(0, 400, 3000)) + rng.integers(0, 20, 3000)
    with BagWriter(tmp_path / "bag") as bag:
        for number, stamp_ns in enumerate(stamps_ns.tolist()):
            bag.write(f"/{number % 3}", text(typestore, f"{number} " * 300), stamp_ns)
    topics = ["/0", "/2"]
    with open_bag(tmp_path / "bag") as bag, AnyReader([tmp_path / "bag"]) as reader:
        connections = [each for each in reader.connections if each.topic in topics]
        expected = [(each.topic, *rest) for each, *rest in reader.messages(connections)]
        assert [(m.topic, m.stamp_ns, m.data) for m in bag.messages(topics)] == expected


def test_the_same_calls_give_the_same_bytes(tmp_path, typestore):
    entries = [("/a", text(typestore, "x"), 1), ("/b", skeleton(typestore), 2)]
    for folder in ("one", "two"):
        write_bag(tmp_path / folder / "bag", entries)
    for name in ("bag.mcap", "metadata.yaml"):
        one, two = (tmp_path / folder / "bag" / name for folder in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()


def test_a_chosen_topic_is_read_alone(tmp_path, typestore):
    write_bag(tmp_path / "bag", [("/a", text(typestore, "x"), 1), ("/b", text(typestore, "y"), 2)])
    with open_bag(tmp_path / "bag") as bag:
        assert [message.topic for message in bag.messages(["/b"])] == ["/b"]
        assert list(bag.messages(["/c"])) == []
        assert list(bag.messages([])) == []


def test_a_latched_topic_is_recorded_as_latched(tmp_path, typestore):
    with BagWriter(tmp_path / "bag") as bag:
        bag.add_topic("/urdf", "std_msgs/msg/String", latched=True, depth=1)
        bag.write("/urdf", text(typestore, "<robot/>"), 1)
        bag.write("/plain", text(typestore, "x"), 2)
    with open_bag(tmp_path / "bag") as bag:
        assert {name: topic.latched for name, topic in bag.topics.items()} == {
            "/urdf": True,
            "/plain": False,
        }
        assert bag.topics["/urdf"].count == 1


def test_definitions_are_read_from_the_bag_itself(tmp_path, typestore, monkeypatch):
    # A reader that knows no types at all still understands what we recorded.
    from rosbags.typesys import Stores, get_typestore

    write_bag(tmp_path / "bag", [("/a", skeleton(typestore, person="somebody"), 1)])
    monkeypatch.setattr(bags, "make_typestore", lambda: get_typestore(Stores.EMPTY))
    with open_bag(tmp_path / "bag") as bag:
        (message,) = bag.messages()
        assert bag.deserialize(message).id == "somebody"


def test_serialized_messages_are_stored_as_they_are(tmp_path, typestore):
    data = bytes(typestore.serialize_cdr(text(typestore, "raw"), "std_msgs/msg/String"))
    with BagWriter(tmp_path / "bag") as bag:
        bag.write_serialized("/a", "std_msgs/msg/String", data, 3)
    with open_bag(tmp_path / "bag") as bag:
        (message,) = bag.messages()
    assert bytes(message.data) == data


def test_an_existing_path_is_never_touched(tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(InputError, match="exists already"):
        BagWriter(tmp_path / "bag")
    assert list((tmp_path / "bag").iterdir()) == []


def test_an_error_while_writing_leaves_nothing_behind(tmp_path, typestore):
    bag = BagWriter(tmp_path / "bag")
    bag.write("/a", text(typestore, "x"), 1)
    with pytest.raises(ZeroDivisionError), bag:
        bag.write("/a", text(typestore, "y"), 1 // 0)
    assert list(tmp_path.iterdir()) == []


def test_an_unfinished_bag_is_not_at_its_path(tmp_path, typestore):
    bag = BagWriter(tmp_path / "bag")
    bag.write("/a", text(typestore, "x"), 1)
    assert not (tmp_path / "bag").exists()
    bag.close()
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_a_topic_with_two_types_is_refused(tmp_path, typestore):
    entries = [("/a", text(typestore, "x"), 1), ("/a", skeleton(typestore), 2)]
    with pytest.raises(InputError, match="/a has type"):
        write_bag(tmp_path / "bag", entries)


def test_an_unknown_package_is_named(tmp_path):
    with pytest.raises(InputError, match="'no_such_msgs'"), BagWriter(tmp_path / "bag") as bag:
        bag.add_topic("/a", "no_such_msgs/msg/Thing")


def test_an_unknown_storage_is_refused(tmp_path):
    with pytest.raises(InputError, match="expected one of mcap, sqlite3"):
        BagWriter(tmp_path / "bag", storage="zip")


def damaged(path: Path, typestore, damage) -> Path:
    write_bag(path, [("/a", text(typestore, str(i) * 100), i) for i in range(100)])
    file = path / f"{path.name}.mcap"
    file.write_bytes(damage(file.read_bytes()))
    return path


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path, _: path, "found no bag"),
        (lambda path, _: path.mkdir() or path, "no metadata.yaml and no .mcap or .db3 files"),
        (lambda path, _: path.write_text("x") and path, "is not a bag"),
        (lambda path, ts: damaged(path, ts, lambda data: data[: len(data) // 2]), "not a readable"),
        (lambda path, ts: damaged(path, ts, lambda _: b""), "not a readable"),
        (lambda path, ts: BagWriter(path, typestore=ts).close() or path, "empty bag"),
    ],
    ids=["missing", "a folder", "a file", "truncated", "no bytes", "no messages"],
)
def test_what_is_no_bag_is_refused_in_one_line(tmp_path, typestore, make, message):
    path = make(tmp_path / "bag", typestore)
    with pytest.raises(InputError, match=message) as caught:
        open_bag(path)
    assert "\n" not in str(caught.value)


def test_an_interrupted_bag_is_refused_with_instructions_to_repair_it(tmp_path, typestore):
    with BagWriter(tmp_path / "bag") as bag:
        for stamp_ns in range(100):
            bag.write("/skeleton", skeleton(typestore), stamp_ns)
    file = tmp_path / "bag" / "bag.mcap"
    file.write_bytes(file.read_bytes()[:-200])

    with pytest.raises(InputError, match=r"copy it again, or repair it with './pose doctor"):
        open_bag(tmp_path / "bag")


def test_damage_inside_a_bag_is_one_line_when_it_is_reached(tmp_path, typestore):
    path = damaged(
        tmp_path / "bag", typestore, lambda data: data[:2000] + b"\xff" * 4000 + data[6000:]
    )
    with pytest.raises(InputError, match=r"damaged|not a"), open_bag(path) as bag:
        [bag.deserialize(message) for message in bag.messages()]
