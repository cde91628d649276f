"""Polled subscriptions, whose messages wait in their queues until they are read.

An executor that wakes for every sample of nine IMUs spends most of its time on waking. When it is
behind, it takes one message of each topic in turn, so that slow topics overtake fast ones. The
messages here are read all at once, when a frame needs them.
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
    """Callback group whose subscriptions an executor does not wait for."""

    def can_execute(self, entity: Any) -> bool:
        """Never execute a callback."""
        del entity
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Likewise."""
        del entity
        return False

    def ending_execution(self, entity: Any) -> None:
        """Nothing ends that never begins."""


class Losses:
    """Counts messages that the middleware lost before a subscription could read them.

    The count is polled, because waiting for this event also wakes for every message of the topic.
    """

    def __init__(self, subscription: Subscription) -> None:
        with subscription.handle:
            self._event = rclpy_implementation.EventHandle(
                subscription.handle, QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST
            )

    def count(self) -> int:
        """Number of lost messages since the last call."""
        with self._event:
            return int(self._event.take_event().total_count_change)

    def destroy(self) -> None:
        """Release the subscription."""
        self._event.destroy_when_not_in_use()


class Inbox:
    """Serialised messages of several topics.

    Args:
        node: The node that subscribes.
        message_type: Message type of all topics.
        topics: Topics by names of the caller's choice.
        profile: Quality of service; its depth bounds the number of waiting messages.
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
        """All messages since the last call, by the caller's names; without silent topics."""
        taken = {}
        for name, subscription in self._subscriptions.items():
            datas = [data for data, _ in waiting(subscription)]
            if datas:
                taken[name] = datas
        return taken


def waiting(subscription: Subscription) -> list[tuple[bytes, dict[str, Any]]]:
    """The serialised messages in a subscription's queue, each with the middleware's information."""
    entries = []
    with subscription.handle:
        while entry := subscription.handle.take_message(subscription.msg_type, True):
            entries.append(entry)
    return entries


def ignore_message(_data: bytes) -> None:
    """Never called."""
