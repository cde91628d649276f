"""The lifecycle manager: order, restarts, and nodes that somebody deactivates."""

from dataclasses import dataclass

import pytest
from rclpy.parameter import Parameter

from pose_node.node_status import Level, Report
from pose_node.nodes.bring_up import BringUp
from pose_node.nodes.managed import ManagedNode


@dataclass(frozen=True)
class NoParameters:
    """Of a node that needs none."""


class Worker(ManagedNode[NoParameters]):
    """Does nothing."""

    def __init__(self, name, **options):
        waits = [Parameter("autostart", value=False)]
        super().__init__(name, NoParameters, parameter_overrides=waits, **options)

    def configure(self):
        """Nothing to make."""

    def activate(self):
        """Nothing to start."""

    def deactivate(self):
        """Nothing to stop."""

    def cleanup(self):
        """Nothing to discard."""

    def report(self):
        return Report(level=Level.OK, message="working")


@pytest.fixture
def workers(ros_context):
    """Two managed nodes in a namespace."""
    return [ros_context.add(Worker(name, namespace="/robot")) for name in ("first", "second")]


@pytest.fixture
def manager(ros_context, workers):
    names = Parameter("nodes", value=["first", "second"])
    period = Parameter("period", value=0.05)
    return ros_context.add(BringUp(namespace="/robot", parameter_overrides=[names, period]))


@pytest.fixture
def active(workers, manager, spin_until):
    spin_until(lambda: manager._report().message == "all nodes are active", what="activation")
    return workers


def note_checks(manager):
    """List of the last node's states, to which each check adds one."""
    checks = []
    note = manager._note

    def noting(name, state):
        note(name, state)
        if name == "second":
            checks.append(state)

    manager._note = noting
    return checks


def test_nodes_are_brought_up_in_order(active):
    assert all(worker.is_active for worker in active)


def test_a_node_that_somebody_deactivates_stays_so_and_the_next_one_is_still_managed(
    active, manager, spin_until
):
    first, _ = active
    first.trigger_deactivate()
    spin_until(lambda: manager._report().message == "first inactive", what="its state")
    first.trigger_cleanup()
    checks = note_checks(manager)
    spin_until(lambda: len(checks) > 5, what="further checks")

    assert manager._report().message == "first unconfigured"
    assert checks[-1] == "active"

    first.trigger_configure()
    first.trigger_activate()
    spin_until(lambda: manager._report().message == "all nodes are active", what="its state")


def test_a_node_that_starts_again_is_brought_up_again(active, manager, ros_context, spin_until):
    first, _ = active
    ros_context.executor.remove_node(first)
    ros_context._nodes.remove(first)
    first.destroy_node()

    again = ros_context.add(Worker("first", namespace="/robot"))
    spin_until(lambda: again.is_active, what="its activation")


def test_a_node_that_was_shut_down_does_not_hold_up_the_next_one(active, manager, spin_until):
    first, _ = active
    first.trigger_shutdown()
    spin_until(lambda: manager._report().message == "first finalized", what="its state")
    checks = note_checks(manager)
    spin_until(lambda: checks, what="a check of the next node")
    assert checks[-1] == "active"
