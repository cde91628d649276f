"""Subscriptions whose messages wait in their queues until they are asked for.

An executor that wakes for every sample of nine IMUs spends more on waking than all the rest takes;
and when it is behind, it takes one message of each topic in turn, so that slower topics overtake
quicker ones. What waits here is taken all at once, when a frame wants it.
"""

from collections.abc import Mapping
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import QoSSubscriptionEventType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription


class NotWoken(CallbackGroup):
    """Keeps its subscriptions out of what an executor waits for."""

    def can_execute(self, entity: Any) -> bool:
        """Nothing is called."""
        del entity
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Likewise."""
        del entity
        return False

    def ending_execution(self, entity: Any) -> None:
        """Nothing ends that never begins."""


class Losses:
    """Messages that the middleware lost before a subscription could take them.

    They are asked for: whoever waits for this event is woken by every message of the topic too.
    """

    def __init__(self, subscription: Subscription) -> None:
        with subscription.handle:
            self._event = rclpy_implementation.EventHandle(
                subscription.handle, QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST
            )

    def count(self) -> int:
        """How many since the last time."""
        with self._event:
            return int(self._event.take_event().total_count_change)

    def destroy(self) -> None:
        """Let go of the subscription."""
        self._event.destroy_when_not_in_use()


class Inbox:
    """Serialised messages of several topics.

    Args:
        node: The node that subscribes.
        message_type: Of all topics.
        topics: By a name of the caller's.
        profile: Quality of service; its depth is how many messages may wait.
    """

    def __init__(
        self, node: Node, message_type: type, topics: Mapping[str, str], profile: QoSProfile
    ) -> None:
        group = NotWoken()
        self._subscriptions = {
            name: node.create_subscription(
                message_type, topic, ignore_message, profile, callback_group=group, raw=True
            )
            for name, topic in topics.items()
        }

    def take(self) -> dict[str, list[bytes]]:
        """All that has come since the last time, by the caller's names; who sent none is absent."""
        taken = {}
        for name, subscription in self._subscriptions.items():
            datas = [data for data, _ in waiting(subscription)]
            if datas:
                taken[name] = datas
        return taken


def waiting(subscription: Subscription) -> list[tuple[bytes, dict[str, Any]]]:
    """What waits in a subscription's queue, serialised, each with what the middleware notes."""
    entries = []
    with subscription.handle:
        while entry := subscription.handle.take_message(subscription.msg_type, True):
            entries.append(entry)
    return entries


def ignore_message(_data: bytes) -> None:
    """Never called."""
