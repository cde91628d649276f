"""The recorder in a live graph."""

import re

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from pose_msgs.msg import Skeleton, SkeletonArray
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from pose_core.errors import ParameterError
from pose_fusion.nodes.recorder import Recorder, overrides_from_arguments
from pose_io.bags import open_bag
from pose_node.conversions import ns_to_stamp

SENSOR_DATA = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


@pytest.fixture
def record(ros_context, tmp_path):
    """Start a recorder into ``tmp_path/bag``."""

    def record(**values):
        values = {"output": str(tmp_path / "bag"), **values}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        node = Recorder(parameter_overrides=overrides)
        ros_context.executor.add_node(node)
        return node

    def finish(node):
        ros_context.executor.remove_node(node)
        node.destroy_node()

    record.finish = finish
    return record


def publisher_of(ros_context, message_type, topic, profile):
    return ros_context.make_node().create_publisher(message_type, topic, profile)


def skeletons(index):
    array = SkeletonArray(skeletons=[Skeleton(id=f"person {index}", name=["head"])])
    array.header.stamp.sec = index
    return array


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_every_message_is_recorded_byte_by_byte(ros_context, spin_until, record, tmp_path, storage):
    publisher = publisher_of(ros_context, SkeletonArray, "kinect_left/skeletons", 1000)
    recorder = record(topics=["kinect_left/skeletons"], storage=storage)
    spin_until(lambda: publisher.get_subscription_count() == 1, what="the recorder")

    # Serialised by us: the bytes between a message's fields are otherwise any.
    sent = [serialize_message(skeletons(index)) for index in range(200)]
    for message in sent:
        publisher.publish(message)
    spin_until(lambda: recorder._recording.message_count == 200, what="200 messages")
    record.finish(recorder)

    with open_bag(tmp_path / "bag") as bag:
        recorded = [message.data for message in bag.messages()]
    assert recorded == sent


def test_earlier_latched_messages_are_recorded_with_their_qos(
    ros_context, spin_until, record, tmp_path
):
    publisher = publisher_of(ros_context, String, "urdf", LATCHED)
    publisher.publish(String(data="<robot/>"))
    recorder = record(topics=["urdf"])

    spin_until(lambda: recorder._recording.message_count == 1, what="the latched message")
    record.finish(recorder)

    with open_bag(tmp_path / "bag") as bag:
        topic = bag.topics["/urdf"]
        (message,) = bag.messages()
        assert bag.deserialize(message).data == "<robot/>"
    assert topic.latched
    assert topic.count == 1


def test_a_topic_created_later_is_recorded(ros_context, spin_until, record, tmp_path):
    recorder = record(all=True)
    publisher = publisher_of(ros_context, String, "late", 10)
    spin_until(lambda: publisher.get_subscription_count() == 1, what="the recorder")

    publisher.publish(String(data="here"))
    spin_until(lambda: recorder._recording.bag.counts.get("/late") == 1, what="the message")
    record.finish(recorder)

    with open_bag(tmp_path / "bag") as bag:
        assert bag.topics["/late"].count == 1


def test_only_the_named_topics_are_recorded(ros_context, spin_until, record, tmp_path):
    wanted = publisher_of(ros_context, String, "wanted", 10)
    other = publisher_of(ros_context, String, "other", 10)
    recorder = record(topics=["wanted"])
    spin_until(lambda: wanted.get_subscription_count() == 1, what="the recorder")

    other.publish(String(data="no"))
    wanted.publish(String(data="yes"))
    spin_until(lambda: recorder._recording.message_count == 1, what="the message")
    record.finish(recorder)

    with open_bag(tmp_path / "bag") as bag:
        assert list(bag.topics) == ["/wanted"]


def test_a_later_best_effort_publisher_is_recorded_too(ros_context, spin_until, record):
    reliable = publisher_of(ros_context, String, "mixed", 10)
    recorder = record(topics=["mixed"])
    spin_until(lambda: reliable.get_subscription_count() == 1, what="the recorder")

    best_effort = publisher_of(ros_context, String, "mixed", SENSOR_DATA)
    spin_until(lambda: best_effort.get_subscription_count() == 1, what="the weaker subscription")
    best_effort.publish(String(data="b"))

    spin_until(lambda: recorder._recording.message_count == 1, what="the message")
    record.finish(recorder)


def test_counts_are_in_the_diagnostics(ros_context, spin_until, record):
    publisher = publisher_of(ros_context, String, "greeting", 10)
    received = ros_context.collect(DiagnosticArray, "/diagnostics")
    recorder = record(topics=["greeting"])
    spin_until(lambda: publisher.get_subscription_count() == 1, what="the recorder")
    publisher.publish(String(data="a"))

    def counts():
        statuses = [s for array in received for s in array.status if s.name == "/recorder"]
        return {pair.key: pair.value for pair in statuses[-1].values} if statuses else {}

    spin_until(lambda: counts().get("/greeting") == "1", what="the count")
    record.finish(recorder)
    assert counts()["lost_messages"] == "0"


def test_what_comes_while_the_disk_is_slow_is_recorded_or_counted_as_lost(
    ros_context, spin_until, record
):
    publisher = publisher_of(ros_context, String, "greeting", 1000)
    received = ros_context.collect(DiagnosticArray, "/diagnostics")
    recorder = record(topics=["greeting"], depth=10)
    spin_until(lambda: publisher.get_subscription_count() == 1, what="the recorder")
    publisher.publish(String(data="first"))
    spin_until(lambda: recorder._recording.message_count == 1, what="the first message")
    for _ in range(100):  # the recorder is not spun, as while a flush takes long
        publisher.publish(String(data="a"))

    def losses():
        own = [s for array in received for s in array.status if s.name == "/recorder"]
        return [s for s in own if "messages were lost: the machine is too busy" in s.message]

    spin_until(losses, what="the warning")
    lost = {pair.key: pair.value for pair in losses()[-1].values}["lost_messages"]
    assert int(lost) + recorder._recording.message_count == 101
    record.finish(recorder)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"topics": ["a"], "all": True}, "either topics, or all"),
        ({"all": True, "storage": "zip"}, "storage = 'zip' is not one of mcap, sqlite3"),
    ],
)
def test_bad_parameters_are_refused(record, values, complaint):
    with pytest.raises(ParameterError, match=complaint):
        record(**values)


def test_a_recording_without_a_name_goes_into_a_dated_folder(record, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    recorder = record(output="")

    assert re.fullmatch(r"out/record-\d{8}-\d{6}", str(recorder._recording.bag.path))
    record.finish(recorder)


def test_in_simulated_time_messages_are_stamped_by_the_clock(
    ros_context, spin_until, record, tmp_path
):
    clock = publisher_of(ros_context, Clock, "/clock", 10)
    publisher = publisher_of(ros_context, String, "greeting", 10)
    recorder = record(topics=["greeting"], use_sim_time=True)
    spin_until(lambda: publisher.get_subscription_count() == 1, what="the recorder")
    publisher.publish(String(data="before the clock begins"))
    spin_until(lambda: clock.get_subscription_count() == 1, what="the clock's listener")
    clock.publish(Clock(clock=ns_to_stamp(5 * 10**9)))

    spin_until(lambda: recorder._recording.message_count == 1, what="the message")
    record.finish(recorder)

    with open_bag(tmp_path / "bag") as bag:
        assert [message.stamp_ns for message in bag.messages()] == [5 * 10**9]


@pytest.mark.parametrize("files", [["bag.mcap"], ["bag.mcap", "metadata.yaml"]])
def test_a_restarted_recorder_writes_a_new_bag_beside_the_old_one(record, tmp_path, files):
    (tmp_path / "bag").mkdir()
    for file in files:
        (tmp_path / "bag" / file).touch()

    recorder = record()

    assert recorder._recording.bag.path == tmp_path / "bag-2"
    record.finish(recorder)


def test_a_waiting_recorder_that_was_killed_while_it_recorded_goes_on(record, tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag.mcap").touch()

    recorder = record(start_paused=True)
    assert recorder._recording.bag.path == tmp_path / "bag-2"
    record.finish(recorder)

    (tmp_path / "bag" / "metadata.yaml").touch()
    waiting = record(start_paused=True)
    assert waiting._report().message == "not recording"
    record.finish(waiting)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["-o", "x"], {"output": "x"}),
        (["-o", "x", "a", "b"], {"output": "x", "topics": ["a", "b"]}),
        (["--output", "x", "--topics", "a"], {"output": "x", "topics": ["a"]}),
        (["-o", "x", "--storage", "sqlite3"], {"output": "x", "storage": "sqlite3"}),
        ([], {}),
    ],
)
def test_the_command_line_sets_parameters(words, expected):
    overrides = {override.name: override.value for override in overrides_from_arguments(words)}

    assert overrides == expected
