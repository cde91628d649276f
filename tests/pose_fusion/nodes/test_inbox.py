"""Messages that wait until they are read, and those that a full queue has dropped."""

import time

import pytest
from std_msgs.msg import String

from pose_fusion.nodes.inbox import Inbox
from pose_node.nodes.qos import sensor_data

DEPTH = 5


@pytest.fixture
def inbox(ros_context):
    return Inbox(ros_context.make_node("reader"), String, {"one": "text"}, sensor_data(DEPTH))


@pytest.fixture
def publisher(ros_context, inbox, spin_until):
    made = ros_context.make_node("writer").create_publisher(String, "text", sensor_data(100))
    spin_until(made.get_subscription_count, what="discovery")
    return made


def receive(inbox, publisher, spin_until, count):
    """Publish messages; the number of those that are read after the last one has come."""
    for k in range(count):
        publisher.publish(String(data=f"{k} of {count}"))
    taken = []

    def has_last():
        taken.extend(inbox.take().get("one", ()))
        return any(f"{count - 1} of {count}".encode() in data for data in taken)

    spin_until(has_last, what="the last message")
    return len(taken)


def test_what_a_full_queue_drops_is_counted(inbox, publisher, spin_until):
    assert receive(inbox, publisher, spin_until, DEPTH) == DEPTH
    assert inbox.take_lost() == {}

    read = receive(inbox, publisher, spin_until, 50)

    assert read < 50
    assert inbox.take_lost() == {"one": 50 - read}
    assert inbox.take_lost() == {}


def other_publisher(inbox, ros_context, spin_until):
    """Another publisher of the topic, and a function that removes it."""
    node = ros_context.make_node("other")
    publisher = node.create_publisher(String, "text", sensor_data(100))
    spin_until(publisher.get_subscription_count, what="discovery")

    def leave():
        node.destroy_publisher(publisher)
        queue = inbox.queues["one"].subscription
        spin_until(lambda: queue.get_publisher_count() == 1, what="the departure")

    return publisher, leave


def test_a_published_topic_is_unheard_until_its_first_message(inbox, publisher, spin_until):
    spin_until(lambda: inbox.unheard == ["one"], what="discovery")
    receive(inbox, publisher, spin_until, 1)
    assert inbox.unheard == []


def test_of_several_publishers_nothing_is_counted(inbox, publisher, ros_context, spin_until):
    second, _ = other_publisher(inbox, ros_context, spin_until)
    receive(inbox, publisher, spin_until, 3)
    receive(inbox, second, spin_until, 20)
    receive(inbox, publisher, spin_until, 2)

    assert inbox.take_lost() == {}


def test_a_publisher_that_comes_and_leaves_between_two_calls_makes_no_losses(
    inbox, publisher, ros_context, spin_until
):
    receive(inbox, publisher, spin_until, 20)
    second, leave = other_publisher(inbox, ros_context, spin_until)
    receive(inbox, second, spin_until, 1)
    leave()
    receive(inbox, publisher, spin_until, 2)
    assert inbox.take_lost() == {}


def test_a_publisher_that_has_left_makes_no_losses(inbox, publisher, ros_context, spin_until):
    second, leave = other_publisher(inbox, ros_context, spin_until)
    receive(inbox, publisher, spin_until, 20)
    receive(inbox, second, spin_until, 3)
    assert inbox.take_lost() == {}

    receive(inbox, second, spin_until, 1)
    leave()
    receive(inbox, publisher, spin_until, 2)
    assert inbox.take_lost() == {}
    assert inbox.take_lost() == {}

    read = receive(inbox, publisher, spin_until, 50)
    assert inbox.take_lost() == {"one": 50 - read}


def test_the_time_of_reception_is_not_that_of_reading(inbox, publisher, spin_until):
    receive(inbox, publisher, spin_until, 1)
    before_ns = time.time_ns()
    publisher.publish(String(data="waits"))
    time.sleep(0.2)
    after_ns = time.time_ns()
    datas, received_ns = inbox.take_received(after_ns)
    assert len(datas["one"]) == len(received_ns) == 1
    assert before_ns < received_ns[0] < after_ns
