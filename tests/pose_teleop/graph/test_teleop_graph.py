"""A simulated robot follows a person through real processes, which die, and streams that break."""

import signal
import time

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from streamed_person import StreamedPerson
from trajectory_msgs.msg import JointTrajectory

from pose_teleop.arm_controller import command_limits
from pose_teleop.parameters import ArmParameters
from pose_teleop.robot_arm import RobotArm
from pose_teleop.robot_files import load_robot

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]
PERIOD_S = 0.01
PATIENT = (  # a busy machine is no fault here
    *("ramp_time:=0.2", "soft_velocity:=2.0", "settle_time:=0.1"),
    *("max_age:=1.0", "dead_man_timeout:=1.0", "max_lag:=3.0", "max_jump:=3.0"),
)


class Graph:
    """The nodes, the person, what came out."""

    def __init__(self, ros_context, start_process):
        self.context, self._start = ros_context, start_process
        self.node = ros_context.make_node("person")
        self.person = StreamedPerson(self.node)
        self.commands = ros_context.collect(JointTrajectory, "arm/joint_trajectory", 100, self.node)
        self.robot = ros_context.collect(JointState, "arm/joint_states", 100, self.node)
        self.states = []
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        self.processes = {}

    def start(self, name, *arguments):
        path = f"{get_package_prefix('pose_teleop')}/lib/pose_teleop/{name}"
        words = [path, "--ros-args", *(w for a in arguments for w in ("-p", a))]
        self.processes[name] = self._start(words)

    def _on_diagnostics(self, message):
        for status in message.status:
            values = {each.key: each.value for each in status.values}
            if status.name == "/arm":
                self.states.append((values["state"], values["reason"]))

    def stream_until(self, condition, publish=None, held=True):
        due = time.monotonic()

        def step():
            nonlocal due
            if time.monotonic() >= due:
                due = time.monotonic() + PERIOD_S
                (publish or self.person.publish)()
                self.person.hold(held)
            return condition()

        self.context.spin_until(step)

    def reach(self, state, publish=None, held=True, reason=None):
        self.states.clear()
        self.stream_until(
            lambda: (
                self.states and self.states[-1][0] == state and reason in (None, self.states[-1][1])
            ),
            publish,
            held,
        )


def check_commands(graph, since=0):
    arm = RobotArm(load_robot("g1", "left"))
    limits = command_limits(arm, ArmParameters())
    for message in graph.commands[since:]:
        position = np.array([p.positions for p in message.points])
        velocity = np.array([p.velocities for p in message.points])
        acceleration = np.array([p.accelerations for p in message.points])
        assert (position <= limits.upper + 1e-9).all()
        assert (position >= limits.lower - 1e-9).all()
        assert (np.abs(velocity) <= limits.velocity + 1e-9).all()
        assert (np.abs(acceleration) <= limits.acceleration + 1e-9).all()
        assert np.abs(velocity[-1]).max() < 1e-6  # the last point is a stop
    moved = np.array([each.position for each in graph.robot])
    assert (moved > arm.lower).all()
    assert (moved < arm.upper).all()


def test_a_robot_follows_and_stops_whatever_breaks(ros_context, start_process):
    graph = Graph(ros_context, start_process)
    graph.start("simulated_robot")
    graph.start("arm", *PATIENT)

    graph.reach("waiting", held=False, reason="not_held")
    assert not graph.commands
    graph.reach("following")

    graph.reach("frozen", publish=lambda: None, reason="stale")
    graph.reach("following")
    graph.reach("frozen", publish=lambda: graph.person.publish(offset_s=5.0), reason="clock")
    graph.reach("following")
    graph.person.angles = lambda t: np.full(4, np.nan)
    graph.reach("frozen", reason="not_finite")
    graph.person.angles = lambda t: np.array([0.3, 0.4, 0.1, 0.5])
    graph.reach("following")
    graph.reach("frozen", held=False, reason="not_held")
    graph.reach("following")

    graph.processes["arm"].signal(signal.SIGKILL)
    graph.processes["arm"].wait()
    count = len(graph.robot)
    graph.stream_until(lambda: len(graph.robot) > count + 200)
    assert np.abs(graph.robot[-1].velocity).max() < 1e-2
    begun = len(graph.commands)
    graph.start("arm", *PATIENT)
    graph.reach("following")
    first = graph.commands[begun].points[0]
    assert np.abs(first.velocities).max() < 0.5  # softly, from where the robot is
    check_commands(graph)
