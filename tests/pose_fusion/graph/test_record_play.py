"""The recorder and the player as processes, from the command line."""

import resource
import signal

import psutil
import pytest
from ament_index_python.packages import get_package_prefix
from diagnostic_msgs.msg import DiagnosticArray, KeyValue
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from std_msgs.msg import String
from std_srvs.srv import Trigger

from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_node.child_process import executable

pytestmark = pytest.mark.graph

PREFIX = get_package_prefix("pose_fusion")
RECORDER = f"{PREFIX}/lib/pose_fusion/recorder"
PLAYER = f"{PREFIX}/lib/pose_fusion/player"
LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)


def texts(path, topic="/count"):
    with open_bag(path) as bag:
        return [bag.deserialize(message).data for message in bag.messages([topic])]


@pytest.fixture
def recording(ros_context, spin_until, start_process, tmp_path):
    """A running recorder of ``/count`` into ``tmp_path/bag``, and a publisher it listens to."""
    publisher = ros_context.make_node().create_publisher(String, "count", 1000)
    process = start_process([RECORDER, "-o", tmp_path / "bag", "count"])
    spin_until(lambda: publisher.get_subscription_count() == 1, what="the recorder")
    return process, publisher


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_recorder_with_a_complete_bag(
    recording, tmp_path, number, spin_until, ros_context
):
    process, publisher = recording
    reports = ros_context.collect(DiagnosticArray, "/diagnostics")
    for index in range(50):
        publisher.publish(String(data=str(index)))
    all_there = KeyValue(key="/count", value="50")
    spin_until(
        lambda: any(all_there in status.values for r in reports for status in r.status),
        what="50 messages recorded",
    )
    process.signal(number)

    assert process.wait() == 0
    assert f"recorder: 50 messages in {tmp_path / 'bag'}" in process.output
    assert texts(tmp_path / "bag") == [str(index) for index in range(50)]


def test_a_killed_recorder_leaves_all_flushed_messages(recording, tmp_path, spin_until):
    process, publisher = recording
    file = tmp_path / "bag" / "bag.mcap"
    sent = 0

    def flushed():
        nonlocal sent
        publisher.publish(String(data=str(sent)))
        sent += 1
        return file.stat().st_size > 2000

    spin_until(flushed, what="a flush")
    process.signal(signal.SIGKILL)
    process.wait()

    found = texts(tmp_path / "bag")
    assert found == [str(index) for index in range(len(found))]
    assert found


OPERATOR = """\
- group:
    children:
    - push_ros_namespace: {{namespace: "{0}"}}
    - node:
        pkg: "pose_fusion"
        exec: "recorder"
        name: "{0}"
        respawn: "true"
        respawn_delay: 0.1
        param: [{{name: "output", value: "{1}"}}]
"""


@pytest.fixture
def operators(start_process, tmp_path):
    """Start a graph with these operators, whose recorders are given the same folder."""

    def operators(*names):
        file = tmp_path / "x.launch.yaml"
        file.write_text(
            "launch:\n" + "".join(OPERATOR.format(name, tmp_path / "bag") for name in names)
        )
        return start_process([executable("pose_launch", "up"), file])

    return operators


def test_a_recorder_that_is_stopped_and_then_killed_goes_on_in_the_next_bag(
    operators, ros_context, spin_until, tmp_path
):
    graph = operators("one")
    graph.wait_for_output(r"recording every topic into \S+/bag\n")
    stop = ros_context.make_node().create_client(Trigger, "/one/one/stop")
    spin_until(stop.service_is_ready, what="the recorder")
    stopped = stop.call_async(Trigger.Request())
    spin_until(stopped.done, what="the end of the first bag")
    (recorder,) = psutil.Process(graph.pid).children()
    recorder.kill()

    graph.wait_for_output(r"recording every topic into \S+/bag-2: \S+/bag exists already\n")
    assert graph.stop() == 0
    assert (tmp_path / "bag" / "metadata.yaml").exists()


def test_two_recorders_with_one_folder_have_bags_of_their_own(operators):
    graph = operators("one", "two")

    graph.wait_for_output(r"recording every topic into \S+/bag\n")
    graph.wait_for_output(r"recording every topic into \S+/bag-2: \S+/bag exists already\n")
    assert graph.stop() == 0


def test_a_full_disk_ends_the_bag_and_a_new_one_starts_once_there_is_space(
    recording, spin_until, tmp_path
):
    process, publisher = recording
    file = tmp_path / "bag" / "bag.mcap"

    def publish():
        publisher.publish(String(data="x" * 5000))

    def flushed():
        publish()
        return file.stat().st_size > 2000

    spin_until(flushed, what="a flush")
    limit = file.stat().st_size + 10_000
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))

    def is_complete():
        publish()
        return (tmp_path / "bag" / "metadata.yaml").exists()

    spin_until(is_complete, what="the end of the first bag")
    assert set(texts(tmp_path / "bag")) == {"x" * 5000}
    assert process.returncode is None
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
    following = tmp_path / "bag-2" / "bag-2.mcap"

    def goes_on():
        publish()
        return following.exists() and following.stat().st_size > 20_000

    spin_until(goes_on, what="the next bag")
    process.signal(signal.SIGINT)

    assert process.wait() == 0
    assert "cannot write" in process.output
    assert "Traceback" not in process.output
    assert set(texts(tmp_path / "bag-2")) == {"x" * 5000}


def test_a_recorded_bag_is_played_byte_by_byte(ros_context, spin_until, start_process, tmp_path):
    # Whole words of four bytes: the wire fills up the last one.
    sent = [serialize_message(String(data=f"{index:03}")) for index in range(100)]
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/latched", "std_msgs/msg/String", latched=True)
        writer.write_serialized("/latched", "std_msgs/msg/String", sent[0], 10**9)
        for index, data in enumerate(sent):
            writer.write_serialized(
                "/count", "std_msgs/msg/String", data, 10**9 + index * 1_000_000
            )
    received, latched = [], []
    node = ros_context.make_node()
    node.create_subscription(String, "count", received.append, 1000, raw=True)
    node.create_subscription(String, "latched", latched.append, LATCHED, raw=True)

    process = start_process([PLAYER, tmp_path / "bag", "--wait-for-subscribers", "30"])
    spin_until(lambda: len(received) == 100 and latched, what="the messages")

    assert process.wait() == 0
    assert received == sent
    assert latched == [sent[0]]


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        ([PLAYER, "no_such_bag"], "found no bag at no_such_bag"),
        ([PLAYER, "/"], "/ is not a bag"),
        ([PLAYER, "--ros-args", "-p", "rate:=two"], "rate"),
        ([RECORDER, "-o", "/", "count"], "/ exists already"),
        ([RECORDER, "-o", "/proc/x", "count"], "cannot write /proc/x"),
    ],
)
def test_bad_input_is_reported_in_one_line_with_exit_code_1(start_process, command, complaint):
    process = start_process(command)

    assert process.wait() == 1
    assert len(process.output.splitlines()) == 1
    assert process.output.startswith("error: ")
    assert complaint in process.output
