"""Device clocks from the topic ``clock_offsets``, live or in a bag."""

import re
import warnings
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np

from pose_core.api import Clock
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S, nanoseconds

if TYPE_CHECKING:  # slow to import, and live nodes do not need it
    from pose_io.bags import BagReader

CLOCK_TOPIC = re.compile(r"(?:^|/)clock_offsets$")
MAX_OFFSET_NS = 86_400 * NS_PER_S  # [ns] of a clock that anybody has set
DRIFT_OVER_NS = 120 * NS_PER_S  # [ns] duration of messages from which on a drift is estimated


def clock_of(message: Any) -> Clock:
    """Convert a ``sensor_msgs/TimeReference`` (of ROS or of rosbags) to a clock.

    Raises:
        InputError: If the clock is more than a day ahead or behind.
    """
    at_ns = nanoseconds(message.time_ref)
    offset_ns = at_ns - nanoseconds(message.header.stamp)
    if abs(offset_ns) > MAX_OFFSET_NS:
        days = offset_ns / MAX_OFFSET_NS
        raise InputError(
            f"the clock of '{message.source}' is {days:+.0f} days ahead of the reference "
            "sensor's, expected less than one: time_ref and header.stamp are of "
            "different epochs; set use_sim_time alike for all nodes"
        )
    return Clock(offset_ns=offset_ns, at_ns=at_ns)


def read_clocks(bag: "BagReader") -> dict[str, Clock]:
    """The clocks of a bag's topic ``clock_offsets``, by source.

    The last message is used; messages over more than two minutes also give the clock's drift.

    Warns:
        UserWarning: If a source's clock is implausible, which is left out.
    """
    implausible: dict[str, str] = {}
    by_source: dict[str, list[Clock]] = defaultdict(list)
    topics = [
        t for t in bag.topics_of_type("sensor_msgs/msg/TimeReference") if CLOCK_TOPIC.search(t)
    ]
    for message in bag.messages(topics) if topics else ():
        content = bag.deserialize(message)
        try:
            clock = clock_of(content)
        except InputError as error:
            implausible[content.source] = str(error)
            continue
        by_source[content.source].append(clock)
    for line in implausible.values():
        warnings.warn(f"{bag.path}: clock_offsets is not used: {line}", stacklevel=2)
    return {source: _fitted(clocks) for source, clocks in sorted(by_source.items())}


def _fitted(clocks: list[Clock]) -> Clock:
    last = clocks[-1]
    # The first messages are estimated from a few seconds of motion.
    later = [c for c in clocks[len(clocks) // 3 :] if c.at_ns <= last.at_ns]
    if last.at_ns - later[0].at_ns < DRIFT_OVER_NS:
        return last
    from scipy.stats import theilslopes  # takes a second to load: not at a node's start

    at_s = np.array([(c.at_ns - last.at_ns) / NS_PER_S for c in later])
    slope, intercept, *_ = theilslopes([float(c.offset_ns) for c in later], at_s)
    return Clock(offset_ns=round(float(intercept)), drift=float(slope) / NS_PER_S, at_ns=last.at_ns)
