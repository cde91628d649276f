"""The player in a live graph."""

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from pose_core.errors import InputError, ParameterError
from pose_core.stamps import nanoseconds
from pose_fusion.nodes.player import Player, overrides_from_arguments, warn_of_others
from pose_io.bag_writer import BagWriter
from pose_node.node_status import Level

LATCHED = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
STEP_NS = 10_000_000


@pytest.fixture
def bag(tmp_path):
    """``/latched`` once, then twenty numbers on ``/count``, 10 ms apart."""
    path = tmp_path / "bag"
    with BagWriter(path) as writer:
        text = writer.typestore.types["std_msgs/msg/String"]
        writer.add_topic("/latched", "std_msgs/msg/String", latched=True)
        writer.write("/latched", text("model"), 10**9)
        for index in range(20):
            writer.write("/count", text(str(index)), 10**9 + index * STEP_NS)
    return path


@pytest.fixture
def play(ros_context, bag):
    """Start a player on the bag."""

    def play(**values):
        values = {"bag": str(bag), **values}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        return ros_context.add(Player(parameter_overrides=overrides))

    return play


def texts(received):
    return [message.data for message in received]


def test_all_messages_arrive_in_order_once_subscribed(ros_context, spin_until, play):
    count = ros_context.collect(String, "count", 100)
    latched = ros_context.collect(String, "latched", LATCHED)
    play(wait_for_subscribers=10.0, pause_at_end=True)

    spin_until(lambda: len(count) == 20 and latched, what="the messages")

    assert texts(count) == [str(index) for index in range(20)]
    assert texts(latched) == ["model"]


def test_messages_are_published_byte_by_byte(ros_context, spin_until, play):
    raw = []
    ros_context.make_node().create_subscription(String, "count", raw.append, 100, raw=True)
    ros_context.collect(String, "latched", LATCHED)
    play(wait_for_subscribers=10.0, pause_at_end=True)

    spin_until(lambda: len(raw) == 20, what="the messages")

    assert raw[7] == serialize_message(String(data="7"))


def test_late_subscribers_receive_latched_messages(ros_context, spin_until, play):
    player = play(pause_at_end=True)
    spin_until(lambda: player._counters["played"] == 21, what="the end")

    latched = ros_context.collect(String, "latched", LATCHED)

    spin_until(lambda: latched, what="the latched message")


def test_only_chosen_topics_are_published(ros_context, spin_until, play):
    player = play(topics=["latched"], pause_at_end=True)
    spin_until(lambda: player._finished, what="the end")

    assert player._counters["played"] == 1
    assert "/count" not in dict(player.get_topic_names_and_types())


def test_the_player_loops(ros_context, spin_until, play):
    player = play(loop=True, rate=10.0)

    spin_until(lambda: player._counters["played"] > 60, what="the third round")


def test_the_player_shuts_down_at_the_end(spin_until, play):
    player = play(rate=10.0)

    spin_until(lambda: not rclpy.ok(), what="the shutdown")

    assert player._counters["played"] == 21


def test_the_player_pauses_and_resumes(ros_context, spin_until, play):
    player = play(start_paused=True, pause_at_end=True)
    node = ros_context.make_node("caller")
    pause = node.create_client(Trigger, "/player/pause")
    resume = node.create_client(Trigger, "/player/resume")
    spin_until(lambda: pause.service_is_ready() and resume.service_is_ready(), what="services")

    def call(client):
        future = client.call_async(Trigger.Request())
        spin_until(future.done, what="the answer")
        return future.result()

    assert player._counters["played"] == 0
    assert call(pause).message == "paused at 0.000 s"
    assert call(resume).success
    spin_until(lambda: player._finished, what="the end")
    assert player._counters["played"] == 21
    answer = call(resume)
    assert (answer.success, answer.message) == (False, "the end is reached")


def test_topics_that_others_publish_too_are_named(ros_context, spin_until, play):
    ros_context.make_node().create_publisher(String, "count", 10)
    player = play(pause_at_end=True)

    spin_until(lambda: player._warning, what="the warning")

    assert player._warning == "others publish too: /count; --topics names those to play"
    assert player._report().level == Level.WARN
    assert player._report().message.endswith(player._warning)


def test_transforms_and_diagnostics_of_others_are_no_reason_to_warn(ros_context, spin_until):
    node, other = ros_context.make_node("a"), ros_context.make_node("b")
    shared = [(TFMessage, "tf"), (DiagnosticArray, "/diagnostics")]
    publishers = [node.create_publisher(kind, topic, 10) for kind, topic in shared]
    for kind, topic in shared:
        other.create_publisher(kind, topic, 10)
    spin_until(lambda: all(node.count_publishers(topic) == 2 for _, topic in shared))

    assert warn_of_others(node, publishers) == ""


@pytest.mark.parametrize(
    ("values", "error", "complaint"),
    [
        ({"bag": ""}, ParameterError, "bag is not set"),
        ({"bag": "/nowhere"}, InputError, "found no bag at /nowhere"),
        ({"topics": ["/x"]}, InputError, "holds no topic /x"),
        ({"start_offset": 9.0}, InputError, "is after the end"),
        ({"rate": 0.0}, ParameterError, "rate"),
    ],
)
def test_bad_parameters_are_refused(play, values, error, complaint):
    with pytest.raises(error, match=complaint):
        play(**values)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["x"], {"bag": "x"}),
        (["--bag", "x"], {"bag": "x"}),
        (["x", "--rate", "2", "--loop"], {"bag": "x", "rate": 2.0, "loop": True}),
        ([], {}),
    ],
)
def test_the_command_line_sets_parameters(words, expected):
    overrides = {override.name: override.value for override in overrides_from_arguments(words)}

    assert overrides == expected


def test_the_clock_is_published_before_the_messages(ros_context, spin_until, play):
    node = ros_context.make_node()
    heard = []
    node.create_subscription(Clock, "/clock", lambda m: heard.append(nanoseconds(m.clock)), 1000)
    count = ros_context.collect(String, "count", 100)
    ros_context.collect(String, "latched", LATCHED)
    play(clock=True, wait_for_subscribers=10.0, pause_at_end=True)

    spin_until(lambda: len(count) == 20, what="the messages")

    last_ns = 10**9 + 19 * STEP_NS
    spin_until(lambda: heard and heard[-1] == last_ns, what="the bag's last instant")
    assert heard == sorted(heard)
    assert {10**9 + index * STEP_NS for index in range(20)} <= set(heard)
