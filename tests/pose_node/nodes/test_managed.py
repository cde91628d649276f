"""A managed node: what the transitions do, which parameters may change when."""

from dataclasses import dataclass

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_msgs.msg import String

from pose_core.errors import InputError, ParameterError
from pose_core.parameters import parameter
from pose_node.node_status import Level, Report
from pose_node.nodes.managed import ManagedNode


@dataclass(frozen=True, kw_only=True)
class Parameters:
    rate: float = parameter(30.0, unit="Hz", doc="how often", limits=(1.0, 240.0))
    whom: str = parameter("", doc="to whom")
    file: str = parameter("", doc="where from")


class Listener(ManagedNode[Parameters]):
    """Writes down what is done to it."""

    def __init__(self, **options):
        self.log, self.whom, self.fails = [], "", None
        super().__init__("listener", Parameters, **options)

    def configure(self):
        if self.settings.file == "missing":
            raise InputError("found no file 'missing'")
        if self.settings.file == "bug":
            raise ZeroDivisionError("of a programmer")
        self.log.append(f"configured at {self.settings.rate:g} Hz")
        self.changes["whom"] = self.log.append
        self.words = self.create_publisher(String, "words", 10)

    def activate(self):
        self.log.append("activated")
        self.create_subscription(String, "heard", lambda message: None, 10)
        self.create_timer(60.0, lambda: None)

    def deactivate(self):
        self.log.append("deactivated")

    def cleanup(self):
        self.log.append("cleaned up")

    def report(self):
        return Report(level=Level.OK, message="listening")


class Bench:
    """The node, and a client of its services."""

    def __init__(self, ros_context, **values):
        self._context = ros_context
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        self.node = ros_context.add(Listener(parameter_overrides=overrides))
        self._client = ros_context.make_node("client")

    def call(self, kind, service, request):
        client = self._client.create_client(kind, f"/listener/{service}")
        self._context.spin_until(client.service_is_ready, what=service)
        future = client.call_async(request)
        self._context.spin_until(future.done, what=service)
        self._client.destroy_client(client)
        return future.result()

    def go(self, transition):
        number = getattr(Transition, f"TRANSITION_{transition.upper()}")
        request = ChangeState.Request(transition=Transition(id=number))
        return self.call(ChangeState, "change_state", request).success

    @property
    def state(self):
        return self.call(GetState, "get_state", GetState.Request()).current_state.label

    def set(self, name, value):
        """What is said against it; empty: it is set."""
        request = SetParameters.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()]
        )
        (result,) = self.call(SetParameters, "set_parameters", request).results
        return "" if result.successful else result.reason

    @property
    def listens(self):
        return "/heard" in [one.topic_name for one in self.node.subscriptions]


@pytest.fixture
def bench(ros_context):
    def make(**values):
        return Bench(ros_context, **values)

    return make


def test_a_node_configures_and_activates_itself(bench):
    b = bench()

    assert b.state == "active"
    assert b.node.log == ["configured at 30 Hz", "activated"]
    assert b.listens


def test_without_autostart_a_node_waits_for_transitions(bench):
    b = bench(autostart=False)

    assert b.state == "unconfigured"
    assert b.node.log == []
    assert b.go("configure")
    assert b.state == "inactive"
    assert not b.listens
    assert b.go("activate")
    assert b.state == "active"
    assert b.listens


def test_a_deactivated_node_neither_subscribes_nor_publishes_and_can_be_reactivated(bench):
    b = bench()
    timers = len(list(b.node.timers))

    assert b.go("deactivate")
    assert b.state == "inactive"
    assert not b.listens
    assert len(list(b.node.timers)) == timers - 1
    assert b.go("activate")
    assert b.listens
    assert b.node.log[2:] == ["deactivated", "activated"]


def test_a_cleaned_up_node_can_be_reconfigured(bench):
    b = bench()
    assert b.go("deactivate")
    assert b.go("cleanup")
    assert b.state == "unconfigured"
    assert "/words" not in [one.topic_name for one in b.node.publishers]

    assert b.set("rate", 60) == ""
    assert b.go("configure")

    assert b.node.log[-1] == "configured at 60 Hz"


@pytest.mark.parametrize("transition", ["activate", "configure", "inactive_shutdown"])
def test_a_transition_that_does_not_start_in_the_state_is_refused(bench, transition):
    b = bench()

    assert not b.go(transition)
    assert b.state == "active"
    assert b.node.log == ["configured at 30 Hz", "activated"]
    assert b.go("deactivate")


def test_shutdown_stops_the_node_first(bench):
    b = bench()

    assert b.go("active_shutdown")
    assert b.state == "finalized"
    assert b.node.log[2:] == ["deactivated", "cleaned up"]


def test_destruction_stops_the_node_first(bench):
    b = bench()
    b.node.destroy_node()

    assert b.node.log[2:] == ["deactivated", "cleaned up"]


def test_a_configuration_error_is_kept_as_the_reason_and_can_be_corrected(bench):
    b = bench(autostart=False, file="missing")

    assert not b.go("configure")
    assert b.state == "unconfigured"
    assert b.node._report().message == "found no file 'missing'"
    assert b.set("file", "") == ""
    assert b.go("configure")
    assert b.state == "inactive"


def test_an_unexpected_exception_leaves_the_node_unconfigured(bench):
    b = bench(autostart=False, file="bug")

    assert not b.go("configure")
    assert b.state == "unconfigured"
    assert "of a programmer" in b.node._report().message


@pytest.mark.parametrize(("file", "error"), [("missing", InputError), ("bug", ZeroDivisionError)])
def test_a_configuration_error_at_the_start_is_raised(bench, file, error):
    with pytest.raises(error):
        bench(file=file)


def test_a_misspelt_parameter_is_refused_with_the_known_names(bench):
    with pytest.raises(ParameterError, match="unknown parameter raet: expected some of rate"):
        bench(raet=3.0)


def test_a_dynamic_parameter_changes_at_run_time(bench):
    b = bench()

    assert b.set("whom", "anna") == ""
    assert b.node.log[-1] == "anna"


def test_a_static_parameter_is_refused_with_reason_and_remedy(bench):
    b = bench()

    assert b.set("rate", 60.0) == (
        "rate: read when the node is configured: set it at the start, or first"
        " 'ros2 lifecycle set /listener deactivate', then 'cleanup'"
    )
    assert "outside" in b.set("rate", 0.5) or "range" in b.set("rate", 0.5)


def test_the_lifecycle_state_is_in_the_diagnostics(bench):
    b = bench(autostart=False)

    assert b.node._report().message == "unconfigured: ros2 lifecycle set /listener configure"
    b.go("configure")
    assert b.node._report().message == "inactive: ros2 lifecycle set /listener activate"
    b.go("activate")
    assert b.node._report().message == "listening"
    b.go("active_shutdown")
    assert b.node._report().message == "shut down: start the process again"
