"""An executor that wakes a node for a message in half the time of rclpy's.

``rclpy.executors.SingleThreadedExecutor`` looks at all entities of its nodes, and makes a new wait
set, three times for each callback. This one does so when entities come or go, and otherwise waits
for the same ones again.
"""

from collections.abc import Callable, Coroutine, Iterable, Iterator, Sequence
from typing import Any

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.task import Task


class QuickExecutor(SingleThreadedExecutor):
    """Spins nodes whose callbacks are plain functions."""

    def __init__(self) -> None:
        self._has_changed = True  # the base's __init__ may already wake
        super().__init__()

    def spin(self) -> None:
        """Call callbacks in this thread until the executor or the context is shut down.

        Raises:
            rclpy.executors.ExternalShutdownException: If it was the context.
        """
        while self._can_go_on():
            if self._has_changed:
                self._has_changed = False  # before looking: another thread may change more
                entities = _Entities(self.get_nodes())
                wait_set = entities.make_wait_set(self)
            wait_set.clear_entities()
            entities.add_to(wait_set)
            for own in (self._guard, self._sigint_gc):
                wait_set.add_guard_condition(own.handle)
            wait_set.wait(-1)
            if self._can_go_on():
                self._call(entities, wait_set)

    def wake(self) -> None:
        """Rebuild the wait set, because an entity has appeared or disappeared."""
        self._has_changed = True
        super().wake()

    def add_node(self, node: Node) -> bool:
        """Add a node; return whether it is new."""
        self._has_changed = True
        return bool(super().add_node(node))

    def _can_go_on(self) -> bool:
        if not self.context.ok():
            raise ExternalShutdownException
        return not self._is_shutdown

    def _call(self, entities: "_Entities", wait_set: Any) -> None:
        """Call the callbacks of all ready entities, in rclpy's order."""
        for waitable in entities.waitables:
            if waitable.is_ready(wait_set):
                self._finish(self._take_waitable(waitable))
        for timer in entities.ready("timer", wait_set):
            if timer.handle.is_timer_ready():  # it may have been cancelled meanwhile
                timer.handle.call_timer()
                timer.callback()
        for subscription in entities.ready("subscription", wait_set):
            _take(subscription)
        for guard in entities.ready("guard_condition", wait_set):
            guard.callback()
        for client in entities.ready("client", wait_set):
            self._finish(self._take_client(client))
        for service in entities.ready("service", wait_set):
            self._finish(self._take_service(service))
        self._run_tasks()

    def _finish(self, execute: Callable[[], Coroutine[Any, Any, None]] | None) -> None:
        """Run the coroutine that rclpy makes of a service's request or response."""
        if execute is not None:
            task = Task(execute, executor=self)
            task()
            task.result()

    def _run_tasks(self) -> None:
        """Run deferred tasks, such as those that await a service's response."""
        with self._tasks_lock:
            tasks = list(self._tasks)
            self._tasks.clear()
        for task, _, _ in tasks:
            task()
            task.result()


class _Entities:
    """Entities that can wake some nodes."""

    def __init__(self, nodes: Sequence[Node]) -> None:
        self._by_kind = {  # in the order of a wait set's counts
            "subscription": _callable(node.subscriptions for node in nodes),
            "guard_condition": _callable(node.guards for node in nodes),
            "timer": _callable(node.timers for node in nodes),
            "client": _callable(node.clients for node in nodes),
            "service": _callable(node.services for node in nodes),
        }
        self.waitables = _callable(node.waitables for node in nodes)

    def make_wait_set(self, executor: SingleThreadedExecutor) -> Any:
        """Create a wait set for them and for the executor's own two guard conditions."""
        of_waitables = [waitable.get_num_entities() for waitable in self.waitables]
        counts = {
            kind: len(entities) + sum(getattr(each, f"num_{kind}s") for each in of_waitables)
            for kind, entities in self._by_kind.items()
        }
        counts["guard_condition"] += 2
        events = sum(each.num_events for each in of_waitables)
        return rclpy_implementation.WaitSet(*counts.values(), events, executor.context.handle)

    def add_to(self, wait_set: Any) -> None:
        """Add them to a wait set."""
        for kind, entities in self._by_kind.items():
            add = getattr(wait_set, f"add_{kind}")
            for entity in entities:
                add(entity.handle)
        for waitable in self.waitables:
            waitable.add_to_wait_set(wait_set)

    def ready(self, kind: str, wait_set: Any) -> Iterator[Any]:
        """The ready entities of a kind that no previous callback has destroyed."""
        entities = self._by_kind[kind]
        if entities and (pointers := wait_set.get_ready_entities(kind)):
            for entity in entities:
                if entity.handle.pointer in pointers:
                    yield entity


def _callable(of_nodes: Iterable[Iterable[Any]]) -> list[Any]:
    """The entities whose callback group allows their execution."""
    entities = (entity for of_node in of_nodes for entity in of_node)
    return [entity for entity in entities if entity.callback_group.can_execute(entity)]


def _take(subscription: Subscription) -> None:
    """Call a subscription's callback with a message, if there is one."""
    taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    if taken is None:
        return
    message_only = Subscription.CallbackType.MessageOnly
    if subscription._callback_type is message_only:
        subscription.callback(taken[0])
    else:
        subscription.callback(*taken)
