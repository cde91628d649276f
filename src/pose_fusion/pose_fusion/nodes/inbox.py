"""Polled subscriptions, whose messages wait in their queues until they are read.

An executor that wakes for every sample of nine IMUs spends most of its time on waking. When it is
behind, it takes one message of each topic in turn, so that slow topics overtake fast ones. The
messages here are read all at once, when a frame needs them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

MessageInfo = Mapping[str, Any]
"""What the middleware reports of a message: times, and its publisher's sequence number."""


class NotWoken(MutuallyExclusiveCallbackGroup):
    """Callback group whose subscriptions an executor does not wait for."""

    def can_execute(self, entity: Any) -> bool:
        """Never execute a callback."""
        del entity
        return False


class MessageQueue:
    """Messages of one topic that wait until they are taken, and how many of them were lost.

    The middleware's own count of losses lacks the messages that a full queue drops: they are gaps
    in their publisher's numbers. Numbers of several publishers are not comparable: while a topic
    has more than one, and until :meth:`take_lost` has been called twice after that, nothing is
    counted.

    Args:
        subscription: The subscription, with ``raw=True``.
    """

    def __init__(self, subscription: Subscription) -> None:
        self.subscription = subscription
        self.newest = 0  # its publisher's number of the last message; 0: none yet
        self.is_heard = False  # whether any message has come
        self._lost = 0
        self._mixed_calls = 0  # calls of take_lost that the numbers of several publishers affect

    def take(self) -> list[tuple[bytes, MessageInfo]]:
        """All waiting messages, each with the middleware's information."""
        entries = []
        with self.subscription.handle:
            while entry := self.subscription.handle.take_message(self.subscription.msg_type, True):
                entries.append(entry)
        for _, info in entries:
            self.note(info)
        return entries

    def note(self, info: MessageInfo) -> None:
        """Take note of a message that a callback received."""
        self.is_heard = True
        number = info.get("publication_sequence_number") or 0
        if 0 < self.newest < number:
            self._lost += number - self.newest - 1
        elif 0 < number < self.newest:  # another publisher's, which may have left again
            self._mixed_calls = 2
        self.newest = number

    @property
    def has_publisher(self) -> bool:
        """Whether somebody publishes the topic."""
        return bool(self.subscription.get_publisher_count())

    def take_lost(self) -> int:
        """Number of lost messages since the last call."""
        lost, self._lost = self._lost, 0
        publishers = self.subscription.get_publisher_count()
        if publishers > 1:
            self._mixed_calls = 2  # messages of one that has left may still wait at the next call
        elif self._mixed_calls:
            self._mixed_calls -= 1
        elif publishers == 1:
            return lost
        return 0


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
        self.queues = {  # by the caller's names
            name: MessageQueue(
                node.create_subscription(
                    message_type, topic, ignore_message, profile, callback_group=group, raw=True
                )
            )
            for name, topic in topics.items()
        }

    def take(self) -> dict[str, list[bytes]]:
        """All messages since the last call, by the caller's names; without silent topics."""
        return self.take_received(0)[0]

    def take_received(self, now_ns: int) -> tuple[dict[str, list[bytes]], NDArray[np.int64]]:
        """All messages since the last call, and when each was received (n,) [ns].

        Args:
            now_ns: Of messages whose time of reception is unknown.
        """
        taken = {name: queue.take() for name, queue in self.queues.items()}
        datas = {name: [data for data, _ in entries] for name, entries in taken.items() if entries}
        infos = [info for entries in taken.values() for _, info in entries]
        received = [info.get("received_timestamp") or now_ns for info in infos]
        return datas, np.array(received, np.int64)

    @property
    def unheard(self) -> list[str]:
        """Topics that somebody publishes, and of which no message has come yet."""
        return [
            name for name, each in self.queues.items() if not each.is_heard and each.has_publisher
        ]

    def take_lost(self) -> dict[str, int]:
        """Numbers of messages lost since the last call, by the caller's names."""
        return {name: lost for name, queue in self.queues.items() if (lost := queue.take_lost())}


def ignore_message(_data: bytes) -> None:
    """Never called."""
