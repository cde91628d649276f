"""Polled subscriptions, whose messages wait in their queues until they are read.

An executor that wakes for every sample of nine IMUs spends most of its time on waking. When it is
behind, it takes one message of each topic in turn, so that slow topics overtake fast ones. The
messages here are read all at once, when a frame needs them.
"""

from collections.abc import Mapping
from typing import Any

from rclpy.callback_groups import CallbackGroup
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
    """Counts messages that a subscription lost, by gaps in their publisher's numbers.

    The middleware's own count lacks the messages that a full queue drops. Numbers of several
    publishers are not comparable: while a topic has more than one, nothing is counted.

    Args:
        subscription: The subscription.
    """

    def __init__(self, subscription: Subscription) -> None:
        self._subscription = subscription
        self._newest = 0  # number of the last message; 0: none yet
        self._lost = 0

    def note(self, info: Mapping[str, Any]) -> None:
        """Take note of a received message, by the information of the middleware."""
        number = info.get("publication_sequence_number") or 0
        if 0 < self._newest < number:
            self._lost += number - self._newest - 1
        self._newest = number

    def count(self) -> int:
        """Number of lost messages since the last call."""
        lost, self._lost = self._lost, 0
        return lost if self._subscription.get_publisher_count() == 1 else 0


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
        self._losses = {name: Losses(each) for name, each in self._subscriptions.items()}

    def take(self) -> dict[str, list[bytes]]:
        """All messages since the last call, by the caller's names; without silent topics."""
        taken = {}
        for name, subscription in self._subscriptions.items():
            entries = waiting(subscription, self._losses[name])
            if entries:
                taken[name] = [data for data, _ in entries]
        return taken

    def lost(self) -> dict[str, int]:
        """Numbers of messages lost since the last call, by the caller's names."""
        return {name: lost for name, each in self._losses.items() if (lost := each.count())}


def waiting(
    subscription: Subscription, losses: Losses | None = None
) -> list[tuple[bytes, dict[str, Any]]]:
    """The serialised messages in a subscription's queue, each with the middleware's information.

    Args:
        subscription: The subscription.
        losses: Counts the messages that are missing.
    """
    entries = []
    with subscription.handle:
        while entry := subscription.handle.take_message(subscription.msg_type, True):
            entries.append(entry)
    if losses is not None:
        for _, info in entries:
            losses.note(info)
    return entries


def ignore_message(_data: bytes) -> None:
    """Never called."""
