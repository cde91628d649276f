"""The recorder node: writes serialised messages unchanged into a rosbag2 folder."""

import argparse
import sys
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from rclpy.utilities import remove_ros_args

from pose_core.counters import Counters
from pose_core.errors import InputError, ParameterError
from pose_core.parameters import add_arguments
from pose_fusion.nodes import qos
from pose_fusion.nodes.inbox import MessageQueue, NotWoken, ignore_message
from pose_fusion.nodes.services import offer_trigger
from pose_fusion.recording.continued import ContinuedRecording
from pose_fusion.recording.growing_bag import dated_path, was_cut_short
from pose_fusion.recording.parameters import RecorderParameters
from pose_node.node_status import Level, Report
from pose_node.nodes.declaring import overrides_of
from pose_node.nodes.managed import ManagedNode
from pose_node.nodes.message_types import message_class
from pose_node.nodes.running import RCLError, run_node
from pose_node.nodes.steady_timer import steady_timer

DISCOVERY_PERIOD_S = 0.2
CHECKED_AGAIN = 5  # [-] periods of discovery after which recorded topics are checked again
TAKING_PERIOD_S = 0.02  # [s] polling period; waking for each message would cost far more
FLUSH_PERIOD_S = 1.0


class Recorder(ManagedNode[RecorderParameters]):
    """Subscribes to existing topics and to those that appear later, and records them."""

    def __init__(self, **options: Any) -> None:
        self._recording: ContinuedRecording | None = None
        self._said_trouble = ""
        super().__init__("recorder", RecorderParameters, **options)

    def configure(self) -> None:
        """Check the topics and the output."""
        if self.settings.all and self.settings.topics:
            raise ParameterError("set either topics, or all to true")
        self._output = Path(self.settings.output or dated_path())
        self._wanted = [self._resolved(topic) for topic in self.settings.topics]
        self._queues: dict[str, MessageQueue] = {}  # by topic
        self._not_woken = NotWoken()
        self._refused: dict[str, str] = {}  # topics that cannot be recorded, and why
        self._counters = Counters("lost_messages")
        self._discoveries = 0

    def activate(self) -> None:
        """Start recording, unless it waits for ``~/start`` and was not killed while recording."""
        if not self.settings.start_paused or was_cut_short(self._output):
            self._begin()
        offer_trigger(self, "~/start", self._on_start)
        offer_trigger(self, "~/stop", self._on_stop)
        steady_timer(self, DISCOVERY_PERIOD_S, self._discover)
        steady_timer(self, TAKING_PERIOD_S, self._take)
        steady_timer(self, FLUSH_PERIOD_S, self._flush)

    def deactivate(self) -> None:
        """Complete the bag."""
        if self._recording is not None:
            # Also after the shutdown of ROS, when loggers do not print.
            print(f"recorder: {self._finish()}", flush=True)

    # -- bags -----------------------------------------------------------------------------------

    def _begin(self) -> Path:
        """Begin the next bag of the series, and return it."""
        self._recording = ContinuedRecording(self._output, self.settings)
        self._discover()
        path = self._recording.bag.path
        reason = "" if path == self._output else f": {self._output} exists already"
        what = ", ".join(self._wanted) or "every topic"
        self.get_logger().info(f"recording {what} into {path}{reason}")
        return path

    def _finish(self) -> str:
        """Complete the bag, unsubscribe from all topics; return a summary."""
        self._take()
        recording, self._recording = self._recording, None
        if recording is None:
            return ""
        for topic in list(self._queues):
            self._unsubscribe(topic)
        self._refused.clear()
        recording.close()
        count, path = recording.message_count, recording.bag.path
        return f"{count} messages in {path}" if count else "no messages, nothing is left"

    def _on_start(self) -> tuple[bool, str]:
        if self._recording is not None:
            return False, f"already recording into {self._recording.bag.path}"
        try:
            path = self._begin()
        except InputError as error:
            return False, str(error)
        self.diagnostics.publish()
        return True, f"recording into {path}"

    def _on_stop(self) -> tuple[bool, str]:
        if self._recording is None:
            return False, "not recording"
        summary = self._finish()
        self.diagnostics.publish()
        return True, summary

    def _flush(self) -> None:
        if self._recording is not None:
            self._recording.flush()
            self._say_trouble(self._recording.trouble)

    def _say_trouble(self, trouble: str) -> None:
        """Report immediately that recording has become impossible, or possible again."""
        if bool(trouble) == bool(self._said_trouble):
            return
        self._said_trouble = trouble
        if trouble:
            self.get_logger().error(f"{trouble}; it will be tried again")
        elif self._recording is not None:
            self.get_logger().info(f"the recording continues in {self._recording.bag.path}")
        self.diagnostics.publish()

    # -- topics ---------------------------------------------------------------------------------

    def _resolved(self, topic: str) -> str:
        try:
            return self.resolve_topic_name(topic)
        except (RCLError, ValueError) as error:
            reason = str(error).split(", at /")[0]
            raise ParameterError(f"topics: '{topic}' cannot be recorded: {reason}") from error

    def _discover(self) -> None:
        """Subscribe to new topics; adapt to publishers that offer less than before."""
        if self._recording is None:
            return
        self._discoveries += 1
        for topic, types in self.get_topic_names_and_types():
            if topic in self._refused or not self._is_wanted(topic):
                continue
            if topic in self._queues and self._discoveries % CHECKED_AGAIN:
                continue
            offered = [info.qos_profile for info in self.get_publishers_info_by_topic(topic)]
            if not offered:
                continue
            profile = qos.for_subscription(offered, self.settings.depth)
            current = self._queues.get(topic)
            if current is None:
                self._start_topic(topic, types, offered, profile)
                continue
            before = current.subscription.qos_profile
            if (before.reliability, before.durability) != (profile.reliability, profile.durability):
                # It no longer receives from every publisher.
                self._take()
                self._unsubscribe(topic)
                self._subscribe(topic, types[0], profile)

    def _is_wanted(self, topic: str) -> bool:
        if self._wanted:
            return topic in self._wanted
        return not topic_or_service_is_hidden(topic)

    def _start_topic(
        self, topic: str, types: Sequence[str], offered: list[QoSProfile], profile: QoSProfile
    ) -> None:
        try:
            if len(types) > 1:
                raise InputError(f"it carries {' and '.join(types)}")
            message_class(types[0])
            assert self._recording is not None
            self._recording.add_topic(topic, types[0], [qos.to_bag(one) for one in offered])
            self._subscribe(topic, types[0], profile)
        except InputError as error:
            self._refused[topic] = str(error)
            self.get_logger().warning(f"{topic} is not recorded: {error}")

    def _subscribe(self, topic: str, msgtype: str, profile: QoSProfile) -> None:
        # Without what warns of publishers that offer less: they are subscribed to as they offer.
        events = SubscriptionEventCallbacks(use_default_callbacks=False)
        options = {"callback_group": self._not_woken, "raw": True, "event_callbacks": events}
        subscription = self.create_subscription(
            message_class(msgtype), topic, ignore_message, profile, **options
        )
        self._queues[topic] = MessageQueue(subscription)

    def _unsubscribe(self, topic: str) -> None:
        queue = self._queues.pop(topic)
        self._counters.add("lost_messages", queue.take_lost())
        self.destroy_subscription(queue.subscription)

    # -- messages -------------------------------------------------------------------------------

    def _take(self) -> None:
        """Record the received messages of all topics, in the order of their arrival."""
        if self._recording is None or self._recording.trouble:
            return  # messages wait in the queues
        clock = self.get_clock()
        simulated_ns = clock.now().nanoseconds if clock.ros_time_is_active else None
        if simulated_ns == 0:
            return  # there is no time yet: messages wait in the queues
        entries = [
            (noted["received_timestamp"], topic, data)
            for topic, queue in self._queues.items()
            for data, noted in queue.take()
        ]
        for stamp_ns, topic, data in sorted(entries, key=itemgetter(0)):
            self._recording.write(topic, data, stamp_ns if simulated_ns is None else simulated_ns)

    def report(self) -> Report:
        """Report recorded and missing topics."""
        recording = self._recording
        if recording is None:
            return Report(level=Level.OK, message="not recording", values={"bag": ""})
        for queue in self._queues.values():
            self._counters.add("lost_messages", queue.take_lost())
        counts = recording.bag.counts
        missing = [topic for topic in self._wanted if not counts.get(topic)]
        level, message = Level.OK, f"recording {len(counts)} topics into {recording.bag.path}"
        if missing:
            level, message = Level.WARN, f"nothing yet from {', '.join(missing)}"
        if self._refused:
            level, message = Level.WARN, f"not recorded: {', '.join(self._refused)}"
        if recording.trouble:
            level, message = Level.ERROR, f"nothing is recorded: {recording.trouble}"
        elif self._counters["lost_messages"]:
            level, message = Level.WARN, "messages were lost: the machine is too busy"
        values = {
            "bag": recording.bag.path,
            "bags": recording.bags,
            "messages": recording.message_count,
            **self._counters.as_dict(),
            "refused_topics": len(self._refused),
        }
        return Report(level=level, message=message, values={**values, **counts})


def overrides_from_arguments(words: Sequence[str]) -> list[Parameter]:
    """Parameters from ``-o OUTPUT [TOPIC …]`` and the other options."""
    parser = argparse.ArgumentParser(
        prog="pose record",
        description="Record topics into a rosbag2 folder until Ctrl-C.",
        epilog="Without TOPIC, every topic that appears is recorded; without OUTPUT, into"
        " out/record-DATE-TIME. ROS arguments may follow after --ros-args.",
    )
    parser.add_argument("topic", nargs="*", metavar="TOPIC", help="a topic to record")
    parser.add_argument("-o", dest="output", metavar="OUTPUT", help="short for --output")
    add_arguments(parser, RecorderParameters)
    options = vars(parser.parse_args(words))
    topics = options.pop("topic")
    if topics:
        options["topics"] = [*topics, *(options["topics"] or [])]
    return overrides_of(RecorderParameters, options)


def main() -> None:
    """Entry point of the executable."""
    overrides = overrides_from_arguments(remove_ros_args(sys.argv)[1:])
    run_node(lambda: Recorder(parameter_overrides=overrides))
