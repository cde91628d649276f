"""How a node's process ends when a signal comes in the midst of its work."""

import signal
import sys

import pytest

pytestmark = pytest.mark.graph

PROGRAM = """
import os, signal, sys, time
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from pose_node.nodes.running import run_node

class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.words = self.create_publisher(String, "words", 10)
        if WHERE == "making":
            self.say()
        self.create_timer(0.01, self.say)

    def say(self):
        if NUMBER:
            os.kill(os.getpid(), NUMBER)
            while rclpy.ok():
                time.sleep(0.001)
        self.words.publish(String(data="still here"))
        raise rclpy.exceptions.InvalidHandle("of a node that works")

run_node(Talker)
"""


def start(start_process, number, where):
    return start_process([sys.executable, "-c", f"{NAMES.format(number, where)}{PROGRAM}"])


NAMES = "NUMBER, WHERE = {!r}, {!r}\n"


@pytest.mark.parametrize("where", ["making", "publishing"])
def test_a_sigterm_during_a_callback_ends_the_process_cleanly(start_process, where):
    process = start(start_process, int(signal.SIGTERM), where)

    assert process.wait() == 0
    assert "Traceback" not in process.output


def test_errors_without_a_signal_are_not_hidden(start_process):
    process = start(start_process, 0, "publishing")

    assert process.wait() == 1
    assert "of a node that works" in process.output


BUSY = """
import sys, time
import rclpy
from rclpy.node import Node
from pose_node.nodes.running import run_node

class Busy(Node):
    def __init__(self):
        super().__init__("busy")
        self.create_timer(0.01, self.write)

    def write(self):
        print("writing", flush=True)
        while rclpy.ok():
            time.sleep(0.001)
        print("written", flush=True)

run_node(Busy)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_does_not_interrupt_a_callback(start_process, number):
    process = start_process([sys.executable, "-c", BUSY])
    process.wait_for_output("writing")

    process.signal(number)

    assert process.wait() == 0
    assert process.output.split() == ["writing", "written"]


SLOW = """
import time
from pose_node.nodes.running import run_node

def make():
    print("making", flush=True)
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        raise ImportError("initialization failed") from None  # as a compiled module has it

run_node(make)
"""


def test_ctrl_c_interrupts_the_construction_of_a_node(start_process):
    process = start_process([sys.executable, "-c", SLOW])
    process.wait_for_output("making")

    process.signal(signal.SIGINT)

    assert process.wait() == 0
    assert process.output.split() == ["making"]


COMPILING = """
import numba
import rclpy
from rclpy.node import Node
from pose_node.nodes.running import run_node

names = {}
exec("def long(x):" + "x = x * x + 1.0;" * 20000 + "return x", names)

class Compiling(Node):
    def __init__(self):
        super().__init__("compiling")
        self.create_timer(0.01, self.compile)

    def compile(self):
        print("compiling", flush=True)
        numba.njit(names["long"])(1.0)
        print("compiled", flush=True)

run_node(Compiling)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_interrupts_a_compilation_in_a_callback(start_process, number):
    process = start_process([sys.executable, "-c", COMPILING])
    process.wait_for_output("compiling")

    process.signal(number)

    assert process.wait() == 0
    assert process.output.split() == ["compiling"]


ENDED_MEANWHILE = """
import rclpy
from pose_node.nodes.running import run_node

def make():
    raise KeyboardInterrupt

def late():
    context = rclpy.get_default_context()
    context.shutdown()  # as the signal handler's thread does between the question and the call
    context.shutdown()

rclpy.try_shutdown = late
run_node(make)
"""


def test_a_context_that_the_signal_handler_ends_first_is_no_error(start_process):
    process = start_process([sys.executable, "-c", ENDED_MEANWHILE])

    assert process.wait() == 0
    assert process.output == ""
