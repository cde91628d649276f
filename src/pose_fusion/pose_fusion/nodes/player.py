"""The player node: publishes a bag's serialised messages with their original timing."""

import argparse
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log, ParameterEvent
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import ReliabilityPolicy
from rclpy.utilities import remove_ros_args
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage

from pose_core.counters import Counters
from pose_core.errors import InputError, ParameterError
from pose_core.parameters import add_arguments
from pose_core.stamps import NS_PER_S
from pose_fusion.nodes import qos
from pose_fusion.nodes.services import offer_trigger
from pose_fusion.recording.parameters import PlayerParameters
from pose_io.bags import BagMessage, open_bag
from pose_io.playback import PlaybackClock, Playlist
from pose_node.conversions import ns_to_stamp
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import accept_changes, declare_parameters, overrides_of
from pose_node.nodes.diagnostics import DiagnosticsPublisher
from pose_node.nodes.message_types import message_class
from pose_node.nodes.running import run_node
from pose_node.nodes.steady_timer import steady_timer

MIN_DEPTH = 100  # [messages] queue of a publisher
MAX_LATCHED = 10_000  # [messages] that a latched topic keeps for late subscribers
POLL_S = 0.05  # [s] between checks for subscribers
MAX_WAIT_NS = 100_000_000  # [ns]
ACKNOWLEDGE_S = 2.0  # [s] that subscribers may take to receive the last messages
PROGRESS_PERIOD_S = 0.5  # in a terminal
LOGGED_PERIOD_S = 10.0  # elsewhere
CHECK_PERIOD_S = 1.0  # between checks for other publishers
MANY_PUBLISH = (TFMessage, DiagnosticArray, Log, ParameterEvent)  # in any graph
CLOCK = "/clock"
CLOCK_STEP_NS = 2_000_000  # [ns] smallest: more messages would keep subscribers busy
CLOCK_PERIOD_NS = 5_000_000  # [ns] largest interval of /clock in the machine's time


class Player(Node):
    """Publishes each message of a bag when it is due."""

    def __init__(self, **options: Any) -> None:
        super().__init__("player", **options)
        self._settings = declare_parameters(
            self, PlayerParameters, changeable=("rate", "start_offset")
        )
        if not self._settings.bag:
            raise ParameterError("bag is not set: name the bag to play")
        self._bag = open_bag(Path(self._settings.bag))
        topics = [self.resolve_topic_name(topic) for topic in self._settings.topics]
        self._playlist = Playlist(self._bag, topics, self._settings.start_offset)
        self._counters = Counters("played", "skipped_unknown_type")
        self._bag_publishers = self._make_publishers()
        self._warning = ""  # of topics that others publish, too
        self._finished = False
        self._rate = self._settings.rate
        self._time_publisher = (
            self.create_publisher(Clock, CLOCK, 10) if self._settings.clock else None
        )
        self._time_shown_ns = 0  # [ns] last published time
        self._deadline_ns = time.monotonic_ns() + round(
            self._settings.wait_for_subscribers * NS_PER_S
        )
        self._playback: PlaybackClock | None = None  # None while waiting for subscribers
        offer_trigger(self, "~/pause", self._on_pause)
        offer_trigger(self, "~/resume", self._on_resume)
        self._diagnostics = DiagnosticsPublisher(self, self._report)
        in_terminal = sys.stderr.isatty()
        period_s = PROGRESS_PERIOD_S if in_terminal else LOGGED_PERIOD_S
        steady_timer(self, period_s, self._show_progress if in_terminal else self._log_progress)
        steady_timer(self, CHECK_PERIOD_S, self._check_publishers)
        self._timer = steady_timer(self, POLL_S, self._step)
        accept_changes(self, PlayerParameters, self._change)
        self._step()

    def _make_publishers(self) -> dict[str, Publisher]:
        publishers = {}
        # Latched topics first: their subscribers are found while the rest is set up.
        for topic in sorted(self._playlist.topics, key=lambda topic: not topic.latched):
            if topic.name == CLOCK and self._settings.clock:
                continue
            try:
                found = message_class(topic.msgtype)
            except InputError as error:
                self.get_logger().warning(f"{topic.name} is not played: {error}")
                continue
            depth = max(MIN_DEPTH, min(topic.count, MAX_LATCHED) if topic.latched else 0)
            profile = qos.from_bag(topic.offered, depth)
            publishers[topic.name] = self.create_publisher(found, topic.name, profile)
        if not publishers:
            raise InputError(f"{self._bag.path}: no message type in it is installed here")
        return publishers

    def _check_publishers(self) -> None:
        before = self._warning
        self._warning = warn_of_others(self, self._bag_publishers.values())
        if self._warning not in ("", before):
            self.get_logger().warning(self._warning)

    # -- playing --------------------------------------------------------------------------------

    def _step(self) -> None:
        """Publish the messages that are due, and schedule the next step."""
        now_ns = time.monotonic_ns()
        if self._playback is None:
            if not self._subscribers_are_there(now_ns):
                return
            self._begin(now_ns)
        assert self._playback is not None
        if self._playback.paused or self._finished:
            self._sleep(MAX_WAIT_NS)
            return
        position_ns = self._playback.position_ns(now_ns)
        self._publish(self._playlist.due(position_ns))
        next_ns = self._playlist.next_ns
        if next_ns is None:
            self._show_time(self._playlist.end_ns, least_ns=1.0)
            self._end(now_ns)
            return
        if next_ns - position_ns >= CLOCK_STEP_NS * self._rate:  # the next message shows its own
            self._show_time(position_ns)
        self._sleep(self._playback.wait_ns(next_ns, time.monotonic_ns()))

    def _sleep(self, wait_ns: int) -> None:
        longest_ns = MAX_WAIT_NS if self._time_publisher is None else CLOCK_PERIOD_NS
        self._timer.timer_period_ns = min(max(wait_ns, 1), longest_ns)
        self._timer.reset()

    def _subscribers_are_there(self, now_ns: int) -> bool:
        publishers = self._bag_publishers.items()
        missing = [name for name, each in publishers if each.get_subscription_count() == 0]
        if missing and now_ns < self._deadline_ns:
            return False
        if missing and self._settings.wait_for_subscribers > 0.0:
            self.get_logger().warning(f"playing without subscribers on {', '.join(missing)}")
        return True

    def _begin(self, now_ns: int) -> None:
        parameters = self._settings
        self._publish(self._playlist.rewind())
        self._playback = PlaybackClock(
            self._playlist.start_ns, self._rate, paused=parameters.start_paused, now_ns=now_ns
        )
        self.get_logger().info(
            f"playing {self._bag.path}: {len(self._bag_publishers)} topics,"
            f" {self._bag.duration_s:.1f} s, rate {self._rate:g}"
            + (", paused" if parameters.start_paused else "")
        )

    def _end(self, now_ns: int) -> None:
        assert self._playback is not None
        if self._settings.loop:
            self._publish(self._playlist.rewind())
            self._playback.jump(self._playlist.start_ns, now_ns)
            self._sleep(1)
            return
        self._playback.pause(now_ns)
        self._finished = True
        self.get_logger().info(f"played {self._counters['played']} messages")
        if not self._settings.pause_at_end:
            self._wait_for_acknowledgements()
            rclpy.try_shutdown(context=self.context)

    def _wait_for_acknowledgements(self) -> None:
        """Give reliable subscribers time to receive the last messages."""
        deadline_ns = time.monotonic_ns() + round(ACKNOWLEDGE_S * NS_PER_S)
        for publisher in self._bag_publishers.values():
            if publisher.qos_profile.reliability == ReliabilityPolicy.RELIABLE:
                left_ns = max(0, deadline_ns - time.monotonic_ns())
                publisher.wait_for_all_acked(Duration(nanoseconds=left_ns))

    def _publish(self, messages: Iterable[BagMessage]) -> None:
        for message in messages:
            publisher = self._bag_publishers.get(message.topic)
            self._show_time(max(message.stamp_ns, self._playlist.start_ns))
            if publisher is None:
                self._counters.add("skipped_unknown_type")
                continue
            publisher.publish(bytes(message.data))
            self._counters.add("played")

    def _show_time(self, stamp_ns: int, least_ns: float = CLOCK_STEP_NS) -> None:
        """Publish the bag's time: before messages, and while none is due.

        Args:
            stamp_ns: The time [ns].
            least_ns: Least step since the last time shown [ns], at rate 1.
        """
        step_ns = stamp_ns - self._time_shown_ns
        if self._time_publisher is None or 0 <= step_ns < least_ns * self._rate:
            return
        self._time_shown_ns = stamp_ns
        self._time_publisher.publish(Clock(clock=ns_to_stamp(stamp_ns)))

    # -- parameters that change while it plays ---------------------------------------------------

    def _change(self, values: dict[str, float]) -> None:
        if "rate" in values:
            self._rate = values["rate"]
            if self._playback is not None:
                self._playback.change_rate(self._rate, time.monotonic_ns())
        if "start_offset" in values:
            self._seek(values["start_offset"])

    def _seek(self, offset_s: float) -> None:
        """Jump to a position, forward or back; later rounds of a loop start there, too."""
        self._playlist.start_from(offset_s)
        if self._playback is not None:
            self._publish(self._playlist.rewind())
            self._playback.jump(self._playlist.start_ns, time.monotonic_ns())
            self._show_time(self._playlist.start_ns)
            if self._finished:
                self._finished = False
                self._playback.resume(time.monotonic_ns())
            self._sleep(1)

    # -- services and state ---------------------------------------------------------------------

    def _on_pause(self) -> tuple[bool, str]:
        if self._playback is None or self._finished:
            return False, "not playing"
        self._playback.pause(time.monotonic_ns())
        return True, f"paused at {self._position_s():.3f} s"

    def _on_resume(self) -> tuple[bool, str]:
        if self._playback is None or self._finished:
            return False, "the end is reached" if self._finished else "not playing yet"
        self._playback.resume(time.monotonic_ns())
        self._sleep(1)
        return True, f"playing from {self._position_s():.3f} s"

    def _position_s(self) -> float:
        """Time since the start of the bag [s]."""
        if self._playback is None:
            return 0.0
        position_ns = min(self._playback.position_ns(time.monotonic_ns()), self._playlist.end_ns)
        return (position_ns - self._bag.start_ns) / NS_PER_S

    def _report(self) -> Report:
        message = "playing"
        if self._playback is None:
            message = "waiting for subscribers"
        elif self._finished:
            message = "the end is reached"
        elif self._playback.paused:
            message = "paused"
        return Report(
            level=Level.WARN if self._warning else Level.OK,
            message="; ".join(filter(None, (message, self._warning))),
            values={"position_s": f"{self._position_s():.3f}", **self._counters.as_dict()},
        )

    def _progress(self) -> str:
        position_s, duration_s = self._position_s(), self._bag.duration_s
        share = 100.0 * position_s / duration_s if duration_s > 0.0 else 100.0
        state = " (paused)" if self._playback is not None and self._playback.paused else ""
        return f"{position_s:.1f} of {duration_s:.1f} s, {share:.0f} %{state}"

    def _show_progress(self) -> None:
        sys.stderr.write(f"\r{self._progress()}\033[K")
        sys.stderr.flush()

    def _log_progress(self) -> None:
        if self._playback is not None and not self._finished:
            self.get_logger().info(self._progress())

    def destroy_node(self) -> None:
        """Close the bag."""
        if hasattr(self, "_bag"):
            self._bag.close()
        if sys.stderr.isatty():
            sys.stderr.write("\r\033[K")
        super().destroy_node()


def warn_of_others(node: Node, publishers: Iterable[Publisher]) -> str:
    """Warning that names the topics which others publish, too; empty: there are none."""
    topics = [each.topic_name for each in publishers if each.msg_type not in MANY_PUBLISH]
    shared = [topic for topic in topics if node.count_publishers(topic) > 1]
    if not shared:
        return ""
    return f"others publish too: {', '.join(shared)}; --topics names those to play"


def overrides_from_arguments(words: Sequence[str]) -> list[Parameter]:
    """Parameters from ``BAG`` and the options."""
    parser = argparse.ArgumentParser(
        prog="pose play",
        description="Play a bag with its original timing.",
        epilog="Services: ~/pause, ~/resume (std_srvs/Trigger). ROS arguments may follow after"
        " --ros-args.",
    )
    parser.add_argument("path", nargs="?", metavar="BAG", help="the bag to play")
    add_arguments(parser, PlayerParameters)
    options = vars(parser.parse_args(words))
    options["bag"] = options["path"] or options["bag"]
    return overrides_of(PlayerParameters, options)


def main() -> None:
    """Entry point of the executable."""
    overrides = overrides_from_arguments(remove_ros_args(sys.argv)[1:])
    run_node(lambda: Player(parameter_overrides=overrides))
