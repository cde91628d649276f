"""A small lifecycle manager: starts managed nodes in order, and again after a restart."""

from functools import partial
from typing import Any

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.node import Node

from pose_core.errors import ParameterError
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import declare_parameters
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer
from pose_node.parameters import BringUpParameters

NEXT = {
    State.PRIMARY_STATE_UNCONFIGURED: (Transition.TRANSITION_CONFIGURE, "configure"),
    State.PRIMARY_STATE_INACTIVE: (Transition.TRANSITION_ACTIVATE, "activate"),
}
DONE = (State.PRIMARY_STATE_ACTIVE, State.PRIMARY_STATE_FINALIZED)
UNANSWERED_PERIODS = 20  # [-] without a response, after which a request is repeated
REFUSED_PERIODS = 10  # [-] after a refused transition, before it is requested again


class BringUp(Node):
    """Checks the nodes one by one and advances the first one that is not active.

    A node that somebody has deactivated or shut down is left as it is, and the next one is checked.

    Raises:
        ParameterError: If no nodes are named.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("bring_up", **options)
        self._settings = declare_parameters(self, BringUpParameters)
        if not self._settings.nodes:
            raise ParameterError("nodes is empty: name the managed nodes, in the order to start in")
        names = self._settings.nodes
        self._getters = {n: self.create_client(GetState, f"{n}/get_state") for n in names}
        self._setters = {n: self.create_client(ChangeState, f"{n}/change_state") for n in names}
        self._states = dict.fromkeys(names, "not there")
        self._left: set[str] = set()  # nodes that somebody has deactivated
        self._waits = 0  # [periods] until the next request
        steady_timer(self, self._settings.period, self._check)
        self._diagnostics = DiagnosticsPublisher(self, self._report)

    def _check(self) -> None:
        self._waits -= 1
        if self._waits <= 0:
            self._waits = 0
            self._ask(0)

    def _ask(self, index: int) -> None:
        """Ask the node of this index for its state; the others follow once it is active."""
        name = self._settings.nodes[index]
        if not self._getters[name].service_is_ready():
            self._note(name, "not there")
            return
        self._waits = UNANSWERED_PERIODS
        future = self._getters[name].call_async(GetState.Request())
        future.add_done_callback(partial(self._on_state, index))

    def _on_state(self, index: int, future: Any) -> None:
        self._waits = 0
        name, state = self._settings.nodes[index], future.result().current_state
        was_active = self._states[name] == "active"
        self._note(name, state.label)
        if state.id == State.PRIMARY_STATE_ACTIVE:
            self._left.discard(name)
        elif was_active and state.id == State.PRIMARY_STATE_INACTIVE:  # a restarted one is not
            self._left.add(name)
        if state.id in DONE or name in self._left:
            if index + 1 < len(self._settings.nodes):
                self._ask(index + 1)
            return
        if state.id not in NEXT or not self._setters[name].service_is_ready():
            return
        number, step = NEXT[state.id]
        self._waits = UNANSWERED_PERIODS
        request = ChangeState.Request(transition=Transition(id=number))
        future = self._setters[name].call_async(request)
        future.add_done_callback(partial(self._on_changed, index, step))

    def _on_changed(self, index: int, step: str, future: Any) -> None:
        if future.result().success:
            self._waits = 0
            self._ask(index)
            return
        name = self._settings.nodes[index]
        self._waits = REFUSED_PERIODS
        self._note(name, f"refuses to {step}: its log and /diagnostics say why")

    def _note(self, name: str, state: str) -> None:
        if self._states[name] != state:
            self._states[name] = state
            self.get_logger().info(f"{name}: {state}")

    def _report(self) -> Report:
        late = [f"{name} {state}" for name, state in self._states.items() if state != "active"]
        message = "; ".join(late) or "all nodes are active"
        return Report(level=Level.WARN if late else Level.OK, message=message, values=self._states)


def main() -> None:
    """Run the node."""
    run_node(BringUp, parameters=BringUpParameters)
