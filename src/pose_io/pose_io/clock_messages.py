"""Clocks from the topic ``clock_offsets``, live or in a bag."""

import re
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np

from pose_core.api import Clock
from pose_core.stamps import NS_PER_S, nanoseconds

if TYPE_CHECKING:  # reading bags takes a while to import, which a live node does not need
    from pose_io.bags import BagReader

CLOCK_TOPIC = re.compile(r"(?:^|/)clock_offsets$")
DRIFT_OVER_NS = 120 * NS_PER_S  # [ns] of messages before a drift is seen in them


def clock_of(message: Any) -> Clock:
    """A clock as a ``sensor_msgs/TimeReference`` (of ROS or of rosbags) tells it."""
    at_ns = nanoseconds(message.time_ref)
    return Clock(offset_ns=at_ns - nanoseconds(message.header.stamp), at_ns=at_ns)


def read_clocks(bag: "BagReader") -> dict[str, Clock]:
    """The clocks that a bag's ``clock_offsets`` tell of, by source.

    The last message counts; where they cover more than two minutes, so does the drift between them.
    """
    by_source: dict[str, list[Clock]] = defaultdict(list)
    topics = [
        t for t in bag.topics_of_type("sensor_msgs/msg/TimeReference") if CLOCK_TOPIC.search(t)
    ]
    for message in bag.messages(topics) if topics else ():
        content = bag.deserialize(message)
        by_source[content.source].append(clock_of(content))
    return {source: _fitted(clocks) for source, clocks in sorted(by_source.items())}


def _fitted(clocks: list[Clock]) -> Clock:
    last = clocks[-1]
    # The first ones were found from a few seconds of motion.
    later = [c for c in clocks[len(clocks) // 3 :] if c.at_ns <= last.at_ns]
    if last.at_ns - later[0].at_ns < DRIFT_OVER_NS:
        return last
    from scipy.stats import theilslopes  # loads for a second, which no node's start can spare

    at_s = np.array([(c.at_ns - last.at_ns) / NS_PER_S for c in later])
    slope, intercept, *_ = theilslopes([float(c.offset_ns) for c in later], at_s)
    return Clock(offset_ns=round(float(intercept)), drift=float(slope) / NS_PER_S, at_ns=last.at_ns)
