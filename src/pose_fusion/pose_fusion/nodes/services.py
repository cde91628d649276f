"""Services of the type ``std_srvs/Trigger``."""

from collections.abc import Callable

from rclpy.node import Node
from std_srvs.srv import Trigger


def offer_trigger(node: Node, name: str, act: Callable[[], tuple[bool, str]]) -> None:
    """Offer a service; ``act`` returns whether it succeeded, and a message."""

    def respond(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = act()
        return response

    node.create_service(Trigger, name, respond)
