"""The dead-man input: a message that must keep coming, and say that it is held."""

import time
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool

from pose_core.stamps import NS_PER_S
from pose_teleop.nodes.bodies import NEWEST
from pose_teleop.parameters import ArmParameters


class DeadManInput:
    """Listens to the input that the parameters name.

    Args:
        node: The node that listens.
        parameters: The node's.
    """

    def __init__(self, node: Node, parameters: ArmParameters) -> None:
        self._kind, self._button = parameters.dead_man, parameters.joy_button
        self._timeout_ns = round(parameters.dead_man_timeout * NS_PER_S)
        self._pressed_ns: int | None = None
        if self._kind == "joy":
            node.create_subscription(Joy, "joy", self._on_joy, NEWEST)
        elif self._kind == "heartbeat":
            node.create_subscription(Bool, "dead_man", self._on_heartbeat, NEWEST)

    @property
    def is_held(self) -> bool:
        """Whether it has been held until now; without an input it always is."""
        if self._kind == "none":
            return True
        heard = self._pressed_ns
        return heard is not None and time.monotonic_ns() - heard < self._timeout_ns

    def _on_joy(self, message: Any) -> None:
        buttons = message.buttons
        self._note(self._button < len(buttons) and buttons[self._button] == 1)

    def _on_heartbeat(self, message: Any) -> None:
        self._note(message.data)

    def _note(self, is_pressed: bool) -> None:
        self._pressed_ns = time.monotonic_ns() if is_pressed else None
