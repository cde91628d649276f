"""Start, spinning and end of every node: clean on Ctrl-C, one line on a bad parameter."""

import gc
import math
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

import rclpy
from rclpy.exceptions import InvalidHandle, NotInitializedException
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from pose_core.errors import InputError, PoseError
from pose_node.entry import Interrupt, leave
from pose_node.nodes.executor import QuickExecutor
from pose_node.nodes.help import RCLError, answer_arguments

N = TypeVar("N", bound=Node)
SPIN_S = 0.1  # [s] longest wait before it is checked again whether it is done
SHOW_S = 0.3  # [s] between two progress reports


def run_node(
    make_node: Callable[[], Node], args: Sequence[str] | None = None, parameters: type | None = None
) -> None:
    """Make a node, spin it until it is asked to stop by SIGINT or SIGTERM, and exit.

    Args:
        make_node: Makes the node; a :class:`PoseError` from it becomes one line and status 1.
        args: The process's arguments, ``sys.argv`` if None.
        parameters: The dataclass of a node that takes nothing but ROS's arguments: ``--help``
            lists its fields.
    """
    if parameters is not None:
        answer_arguments(make_node, parameters)
    interrupt = Interrupt(once=True)
    interrupt.listen(signal.SIGINT, signal.SIGTERM)  # before rclpy's own handlers, which call it
    try:
        _init(args)
        status = _spin_to_end(make_node, interrupt)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        status = 1
    except KeyboardInterrupt:
        status = 0
    # Cycles of references keep a node's DDS participant, whose files would stay in shared memory.
    gc.collect()
    leave(status)


@contextmanager
def node_of_tool(make_node: Callable[[], N]) -> Iterator[tuple[N, Executor]]:
    """Start ROS for a tool, and make its node and an executor to spin it; both end with the block.

    The command line's ROS arguments, after ``--ros-args``, apply.

    Raises:
        InputError: If these are wrong.
        KeyboardInterrupt: After a signal, which ends the context at once.
    """
    _init(None)
    executor = SingleThreadedExecutor()
    node = None
    try:
        node = make_node()
        executor.add_node(node)
        yield node, executor
    except (ExternalShutdownException, RCLError):
        if rclpy.ok():
            raise
        raise KeyboardInterrupt from None
    finally:
        executor.shutdown()
        if node is not None:
            node.destroy_node()
        _end_ros()


def spin_until(
    executor: Executor,
    is_done: Callable[[], object],
    timeout_s: float = math.inf,
    on_progress: Callable[[], None] = lambda: None,
) -> None:
    """Spin until it is done, or the time [s] is over; call ``on_progress`` now and then."""
    end_s = time.monotonic() + timeout_s
    shown_s = -math.inf
    while not is_done() and (left_s := end_s - time.monotonic()) > 0.0:
        executor.spin_once(timeout_sec=min(left_s, SPIN_S))
        if time.monotonic() > shown_s + SHOW_S:
            shown_s = time.monotonic()
            on_progress()


def _init(args: Sequence[str] | None) -> None:
    """Start ROS; an :class:`InputError` says in one line what is wrong with its arguments."""
    try:
        rclpy.init(args=list(args) if args is not None else None)
    except RCLError as error:
        raise InputError(" ".join(str(error).split(", at /")[0].split())) from None


def _end_ros() -> None:
    """End the context, if the thread of rclpy's signal handler does not end it at this moment."""
    try:
        rclpy.try_shutdown()
    except RCLError:
        if rclpy.ok():
            raise


def _spin_to_end(make_node: Callable[[], Node], interrupt: Interrupt) -> int:
    """Create a node, spin it, and destroy it; return the process's exit code."""
    status = 0
    node: Node | None = None
    executor: QuickExecutor | None = None
    try:
        node = make_node()
        # In the midst of a callback an exception could hit an import, or a file that is written;
        # rclpy's own handler ends the spinning as soon as the callback has returned.
        interrupt.breaks_off = False
        executor = QuickExecutor()
        executor.add_node(node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except PoseError as error:
        print(f"error: {error}", file=sys.stderr)
        status = 1
    except (RCLError, InvalidHandle, NotInitializedException, ImportError):
        # A signal ends the context at once, also in the midst of a callback that then publishes.
        if rclpy.ok() and not interrupt.asked:
            raise
    finally:
        # A launcher and the terminal may both send SIGINT: the second must not break the ending.
        interrupt.breaks_off = False
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        try:
            if node is not None:
                node.destroy_node()
        except PoseError as error:
            print(f"error: {error}", file=sys.stderr)
            status = 1
        # Left to the interpreter's end, it may go after its own guard conditions, and complain.
        if executor is not None:
            executor.shutdown()
        _end_ros()
    return status
