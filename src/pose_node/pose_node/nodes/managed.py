"""Managed nodes: what the standard transitions of ROS 2's lifecycle do to a node of ours.

| transition | what a node does |
|---|---|
| configure | checks its parameters, loads its files, makes what the data goes through |
| activate | listens, publishes |
| deactivate | stops, and keeps what it has learnt: calibration, body, sensor alignment |
| cleanup | forgets it; parameters may be set again |

With ``autostart``, the default, a node configures and activates itself when it starts.
"""

import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from lifecycle_msgs.srv import ChangeState
from rclpy.clock import JumpHandle, JumpThreshold
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from pose_core.errors import ParameterError, PoseError
from pose_core.parameters import from_mapping, specs
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import accept_changes, declare_parameters, descriptor_of
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.help import RCLError
from pose_node.parameters import ManagedParameters

P = TypeVar("P")
LEAP_BACK = JumpThreshold(
    min_forward=None, min_backward=Duration(seconds=-0.5), on_clock_change=False
)


class ManagedNode(LifecycleNode, ABC, Generic[P]):
    """A node with a lifecycle; a subclass says what the transitions do.

    Args:
        name: The node's name.
        parameters: The dataclass that declares its parameters.
        **options: As for ``rclpy.node.Node``.

    Attributes:
        settings: The parameters, as of the last configuring.
        diagnostics: Says once a second how the node does.
        is_active: Whether it listens and publishes.
        changes: What to do with the new value of each parameter that may change while the node is
            configured; filled by :meth:`configure`.

    Raises:
        PoseError: With ``autostart``, if the node cannot be configured or activated.
    """

    settings: P

    def __init__(self, name: str, parameters: type[P], **options: Any) -> None:
        super().__init__(name, **options)
        (service,) = (each for each in self.services if each.srv_type is ChangeState)
        self._change_state, service.callback = service.callback, self._on_change_state
        self._declared = parameters
        self.changes: dict[str, Callable[[Any], None]] = {}
        self.is_active = False
        self._is_configured = False
        self._is_shut_down = False
        self._failure: Exception | None = None
        self._leaps: JumpHandle | None = None
        self._made: dict[str, list[Any]] = {"configure": [], "activate": []}
        self.settings = declare_parameters(
            self, parameters, changeable=specs(parameters), of_others=specs(ManagedParameters)
        )
        for one, (default, spec) in specs(ManagedParameters).items():
            self.declare_parameter(one, default, descriptor_of(default, spec))
        accept_changes(self, parameters, self._change)
        self.diagnostics = DiagnosticsPublisher(self, self._report)
        self._starts = bool(self.get_parameter("autostart").value)
        for trigger in (self.trigger_configure, self.trigger_activate) if self._starts else ():
            if trigger() is not TransitionCallbackReturn.SUCCESS and self._failure is not None:
                raise self._failure
        self._starts = False

    # -- implemented by subclasses --------------------------------------------------------------

    @abstractmethod
    def configure(self) -> None:
        """Check :attr:`settings`, load files; raise a PoseError on failure."""

    @abstractmethod
    def activate(self) -> None:
        """Start to subscribe and to publish."""

    def deactivate(self) -> None:
        """Undo what :meth:`activate` did beyond publishers, subscriptions, services, timers."""

    def cleanup(self) -> None:
        """Likewise of :meth:`configure`; also called when that has failed half-way."""

    def restart_time(self) -> None:
        """Handle a jump back of simulated time: a bag loops or is rewound. Default: do nothing."""

    @abstractmethod
    def report(self) -> Report:
        """State of the active node."""

    # -- transitions ----------------------------------------------------------------------------

    def _on_change_state(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> ChangeState.Response:
        """Refuse a transition that does not start in the present state, at which rclpy raises."""
        try:
            return self._change_state(request, response)
        except RCLError:
            wanted = request.transition.label or f"transition {request.transition.id}"
            machine = self._state_machine
            possible = ", ".join(f"{label} ({n})" for n, label, *_ in machine.available_transitions)
            state = machine.current_state[1]
            self.get_logger().error(f"no {wanted} in state {state}: expected one of {possible}")
            response.success = False
            return response

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Of :class:`rclpy.lifecycle.LifecycleNode`, as are the others."""
        return self._attempt(self._configure, self._clean_up)

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Begin."""
        return self._attempt(self._activate, self._deactivate)

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Stop."""
        return self._attempt(self._deactivate)

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Forget."""
        return self._attempt(self._clean_up)

    def on_shutdown(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Stop and discard everything; the process continues until it is ended."""
        self._is_shut_down = True
        return self._attempt(self._end)

    def on_error(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """After an unexpected exception: unconfigured, with the failure in ``/diagnostics``."""
        self._end()
        return TransitionCallbackReturn.SUCCESS

    def _attempt(
        self, do: Callable[[], None], undo: Callable[[], None] | None = None
    ) -> TransitionCallbackReturn:
        """Do it, or undo what was done of it; what is wrong is logged, and raised at the start."""
        self._failure = None
        try:
            do()
        except Exception as error:
            self._failure = error
            is_foreseen = isinstance(error, PoseError)
            if not self._starts:
                said = str(error) if is_foreseen else "".join(traceback.format_exception(error))
                self.get_logger().error(said)
            if undo is not None:
                undo()
            if is_foreseen and undo is not None:
                return TransitionCallbackReturn.FAILURE  # as it was before
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _configure(self) -> None:
        self._is_configured = True
        values = {name: self.get_parameter(name).value for name in specs(self._declared)}
        self.settings = from_mapping(self._declared, values)
        self._make("configure", self.configure)

    def _activate(self) -> None:
        self.is_active = True
        self._make("activate", self.activate)
        self._leaps = self.get_clock().create_jump_callback(
            LEAP_BACK, post_callback=lambda _: self.restart_time()
        )

    def _deactivate(self) -> None:
        self.is_active = False
        if self._leaps is not None:
            self._leaps.unregister()
            self._leaps = None
        try:
            self.deactivate()
        finally:
            self._unmake("activate")

    def _clean_up(self) -> None:
        self._is_configured = False
        self.changes.clear()
        try:
            self.cleanup()
        finally:
            self._unmake("configure")

    def _end(self) -> None:
        if self.is_active:
            self._deactivate()
        if self._is_configured:
            self._clean_up()

    def destroy_node(self) -> None:
        """Stop, release devices and files, then destroy the node."""
        try:
            self._end()
        finally:
            super().destroy_node()

    # -- publishers, subscriptions, services, timers --------------------------------------------

    def _make(self, step: str, do: Callable[[], None]) -> None:
        """Do it, and remember the entities that it makes."""
        before = {id(entity) for entity, _ in self._entities()}
        try:
            do()
        finally:
            made = [each for each in self._entities() if id(each[0]) not in before]
            self._made[step] = made

    def _unmake(self, step: str) -> None:
        """Destroy the entities that it has made and that are still there."""
        for entity, destroy in self._made[step]:
            destroy(entity)
        self._made[step] = []

    def _entities(self) -> list[tuple[Any, Callable[[Any], bool]]]:
        kinds = (
            (self.subscriptions, self.destroy_subscription),
            (self.timers, self.destroy_timer),
            (self.guards, self.destroy_guard_condition),
            (self.services, self.destroy_service),
            (self.clients, self.destroy_client),
            (self.publishers, self.destroy_publisher),
        )
        return [(entity, destroy) for entities, destroy in kinds for entity in entities]

    # -- parameters and state -------------------------------------------------------------------

    def _change(self, values: dict[str, Any]) -> None:
        if not self._is_configured:
            return  # they are read when the node is configured
        fixed = [name for name in values if name not in self.changes]
        if fixed:
            names, node = ", ".join(fixed), self.get_fully_qualified_name()
            raise ParameterError(
                f"{names}: read when the node is configured: set it at the start, or first"
                f" 'ros2 lifecycle set {node} deactivate', then 'cleanup'"
            )
        for name, value in values.items():
            self.changes[name](value)

    def _report(self) -> Report:
        if self.is_active:
            return self.report()
        if self._failure is not None:
            return Report(level=Level.ERROR, message=str(self._failure))
        if self._is_shut_down:
            return Report(level=Level.WARN, message="shut down: start the process again")
        name = self.get_fully_qualified_name()
        state, step = "unconfigured", "configure"
        if self._is_configured:
            state, step = "inactive", "activate"
        return Report(level=Level.WARN, message=f"{state}: ros2 lifecycle set {name} {step}")
