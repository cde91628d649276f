"""The recorder starts and stops by service."""

import pytest
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import Trigger

from pose_fusion.nodes.recorder import Recorder
from pose_io.bags import open_bag


@pytest.fixture
def recorder(ros_context, tmp_path):
    def make(**values):
        given = {"output": str(tmp_path / "bag"), "topics": ["/chatter"], **values}
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        return ros_context.add(Recorder(parameter_overrides=overrides))

    return make


@pytest.fixture
def call(ros_context, spin_until):
    node = ros_context.make_node()

    def call(name):
        client = node.create_client(Trigger, f"recorder/{name}")
        spin_until(client.service_is_ready)
        future = client.call_async(Trigger.Request())
        spin_until(future.done)
        return future.result()

    return call


def say(ros_context, spin_until, publisher, recorder, count):
    """Publish until the recorder has that many messages more."""
    before = recorder._recording.message_count
    spin_until(lambda: publisher.get_subscription_count() == 1)

    def said():
        publisher.publish(String(data="hello"))
        return recorder._recording.message_count >= before + count

    spin_until(said)


def test_each_start_service_call_creates_a_bag(ros_context, spin_until, recorder, call, tmp_path):
    node = recorder(start_paused=True)
    publisher = ros_context.make_node().create_publisher(String, "/chatter", 10)
    paths = [tmp_path / "bag", tmp_path / "bag-2"]
    assert node._report().message == "not recording"
    for path in paths:
        assert call("start").message == f"recording into {path}"
        assert node._report().values["bag"] == path
        say(ros_context, spin_until, publisher, node, 3)
        answer = call("stop")
        assert answer.success
        assert answer.message.endswith(f"messages in {path}")
        spin_until(lambda: publisher.get_subscription_count() == 0, what="the topic to be let go")

    for path in paths:
        with open_bag(path) as bag:
            assert bag.topics["/chatter"].count >= 3


def test_impossible_requests_are_refused_with_the_reason(recorder, call, tmp_path):
    recorder(start_paused=True)

    assert call("stop").message == "not recording"
    assert call("start").success
    again = call("start")
    assert not again.success
    assert again.message == f"already recording into {tmp_path / 'bag'}"
    assert call("stop").message == "no messages, nothing is left"
