"""The executor calls whatever is ready, and notices entities that come and go."""

import threading
from contextlib import suppress

import pytest
import rclpy
from rclpy.callback_groups import CallbackGroup
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from pose_node.nodes.executor import QuickExecutor

pytestmark = pytest.mark.graph
PATIENCE_S = 30.0


@pytest.fixture
def node(ros_context):
    return ros_context.make_node("quick")


@pytest.fixture
def spin(node):
    """Spins the node until a callback says ``spin.end()``, or patience ends."""
    executor = QuickExecutor()

    def run():
        timer = node.create_timer(PATIENCE_S, lambda: pytest.fail("nothing came"))
        executor.add_node(node)
        executor.spin()
        node.destroy_timer(timer)

    run.end = executor.shutdown
    run.executor = executor
    yield run
    executor.shutdown()


@pytest.fixture
def peer(ros_context):
    """Another node in another thread, under rclpy's executor."""
    peer = ros_context.make_node("peer")
    thread = threading.Thread(target=_spin_quietly, args=(ros_context.executor,), daemon=True)
    thread.start()
    yield peer
    ros_context.executor.shutdown()
    thread.join(PATIENCE_S)


def _spin_quietly(executor):
    with suppress(ExternalShutdownException):
        executor.spin()


def test_messages_are_received_once_and_in_order(node, peer, spin):
    publisher = peer.create_publisher(String, "words", 100)
    sent = [str(number) for number in range(50)]
    taken = []

    def take(message):
        taken.append(message.data)
        if len(taken) == len(sent):
            spin.end()

    def send():
        if publisher.get_subscription_count():
            peer.destroy_timer(timer)
            for word in sent:
                publisher.publish(String(data=word))

    node.create_subscription(String, "words", take, 100)
    timer = peer.create_timer(0.01, send)

    spin()

    assert taken == sent


def test_a_callback_can_receive_the_message_info(node, peer, spin):
    publisher = peer.create_publisher(String, "words", 10)
    told = []

    def take(data, info):
        told.append((type(data), info["source_timestamp"]))
        spin.end()

    node.create_subscription(String, "words", take, 10, raw=True)
    peer.create_timer(0.02, lambda: publisher.publish(String(data="now")))

    spin()

    assert told[0][0] is bytes
    assert told[0][1] > 0


def test_the_executor_handles_service_calls(node, peer, spin):
    answers = []

    def serve(_request, response):
        response.success, response.message = True, "served"
        return response

    def ask():
        if client.service_is_ready() and not asked:
            asked.append(client.call_async(Trigger.Request()))
            asked[0].add_done_callback(lambda future: answers.append(future.result()))
        if answers:
            guard.trigger()

    asked = []
    node.create_service(Trigger, "serve", serve)
    guard = node.create_guard_condition(spin.end)
    client = peer.create_client(Trigger, "serve")
    peer.create_timer(0.02, ask)

    spin()

    assert answers[0].message == "served"


def test_the_executor_delivers_service_responses(node, peer, spin):
    answers = []

    def serve(_request, response):
        response.message = "served"
        return response

    def ask():
        if client.service_is_ready():
            node.destroy_timer(timer)
            client.call_async(Trigger.Request()).add_done_callback(tell)

    def tell(future):
        answers.append(future.result().message)
        spin.end()

    peer.create_service(Trigger, "serve", serve)
    client = node.create_client(Trigger, "serve")
    timer = node.create_timer(0.02, ask)

    spin()

    assert answers == ["served"]


def test_the_executor_delivers_middleware_events(node, peer, spin):
    from rclpy.event_handler import SubscriptionEventCallbacks
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    events = []

    def incompatible(event):
        events.append(event.total_count)
        spin.end()

    peer.create_publisher(
        String, "words", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    )
    node.create_subscription(
        String,
        "words",
        lambda message: None,
        QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE),
        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=incompatible),
    )

    spin()

    assert events == [1]


def test_entities_created_or_destroyed_in_callbacks_are_noticed(node, spin):
    calls = []

    def first():
        calls.append("first")
        node.destroy_timer(one)
        node.destroy_timer(two)  # which is due now too
        node.create_timer(0.05, last)

    def last():
        calls.append("last")
        spin.end()

    one = node.create_timer(0.01, first)
    two = node.create_timer(0.01, lambda: calls.append("destroyed"))

    spin()

    assert calls[-2:] == ["first", "last"]
    assert "destroyed" not in calls


def test_messages_without_a_callback_do_not_wake_the_executor(node, peer, spin, monkeypatch):
    class NotCalled(CallbackGroup):
        def can_execute(self, entity):
            return False

    wakes = []
    call = QuickExecutor._call
    monkeypatch.setattr(QuickExecutor, "_call", lambda *args: (wakes.append(1), call(*args)))
    subscription = node.create_subscription(
        String, "words", lambda message: None, 1000, callback_group=NotCalled()
    )
    publisher = peer.create_publisher(String, "words", 1000)
    sent = []

    def send():
        if publisher.get_subscription_count():
            sent.append(str(len(sent)))
            publisher.publish(String(data=sent[-1]))

    peer.create_timer(0.001, send)
    node.create_timer(0.1, lambda: spin.end() if len(sent) > 200 else None)

    spin()

    with subscription.handle:
        assert subscription.handle.take_message(String, False)[0].data == "0"
    assert len(wakes) < len(sent) / 2


def test_a_cancelled_timer_is_not_called(node, spin):
    calls = []

    def first():
        calls.append("first")
        if len(calls) == 3:
            timer.cancel()
            node.create_timer(0.1, spin.end)

    timer = node.create_timer(0.01, first)

    spin()

    assert calls == ["first"] * 3


def test_entities_created_in_another_thread_wake_the_executor(node, spin):
    def make():
        node.create_timer(0.001, spin.end)

    threading.Timer(0.2, make).start()

    spin()  # would last for as long as its patience


def test_an_exception_in_a_callback_ends_the_executor(node, spin):
    def fail():
        raise ValueError("of a callback")

    node.create_timer(0.01, fail)

    with pytest.raises(ValueError, match="of a callback"):
        spin()


def test_a_node_added_later_is_spun(node, ros_context, spin):
    other = Node("later")
    ros_context.add(other)
    other.create_timer(0.01, spin.end)
    threading.Timer(0.2, lambda: spin.executor.add_node(other)).start()

    spin()


def test_the_end_of_the_context_ends_the_executor(node, spin):
    node.create_timer(0.01, rclpy.shutdown)

    with pytest.raises(ExternalShutdownException):
        spin()
