"""What the fusion that made a bag's body said about itself and its IMUs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pose_core.joints import SEGMENTS
from pose_core.stamps import nanoseconds
from pose_io.bags import BagReader
from pose_io.names import FUSE_STATUS
from pose_io.topics import IMU, body_topic, imu_topics, misnamed_imu_topics
from pose_node.node_status import NodeStatus

NOT_USED = "not used"


@dataclass(frozen=True, kw_only=True)
class RecordedFusion:
    """Reports on one body: its estimator, and the IMUs by segment or, without one, by topic."""

    estimator: str  # empty if it is not said
    used_from_ns: Mapping[str, int]  # [ns] of those used at the end; 0 if the reports do not say
    unused: Mapping[str, str]  # why, of those not used at the end


def read_statuses(bag: BagReader) -> list[NodeStatus]:
    """All statuses in a bag's ``/diagnostics``; `received_ns` is the stamp of their message."""
    return [
        NodeStatus(
            name=status.name,
            values={pair.key: pair.value for pair in status.values},
            received_ns=nanoseconds(content.header.stamp),
        )
        for message in bag.messages(bag.topics_of_type("diagnostic_msgs/msg/DiagnosticArray"))
        for content in [bag.deserialize(message)]
        for status in content.status
    ]


def recorded_fusion(
    bag: BagReader, statuses: Sequence[NodeStatus], body: str = ""
) -> RecordedFusion:
    """Reports of a body's fusion; empty if the bag does not hold them.

    Args:
        bag: An open bag.
        statuses: Its statuses.
        body: Id of the body; empty: the subject's.
    """
    topic = body_topic(bag, "skeleton", body)
    reports = [] if topic is None else [s for s in statuses if _is_of(s, topic.split("/")[-2])]
    estimator, uses = "", dict[str, str]()
    used_from_ns: dict[str, int] = {}
    for report in reports:
        estimator, uses = report.values.get("estimator", ""), _uses(report)
        used = [name for name, text in uses.items() if not text.startswith(NOT_USED)]
        stamp_ns = 0 if report.name == FUSE_STATUS else report.received_ns
        used_from_ns = {name: used_from_ns.get(name, stamp_ns) for name in used}
    unused = {name: text for name, text in uses.items() if name not in used_from_ns}
    if reports:
        heard = {name: topic for name, topic in imu_topics(bag).items() if name not in uses}
        heard |= {topic: topic for topic in misnamed_imu_topics(bag.topics_of_type(IMU))}
        unused |= {name: _unmentioned(bag, name, topic) for name, topic in heard.items()}
    return RecordedFusion(estimator=estimator, used_from_ns=used_from_ns, unused=unused)


def _is_of(status: NodeStatus, body: str) -> bool:
    """Whether a status is the report of a body's fusion, live or offline."""
    if status.name == FUSE_STATUS:
        return True
    return status.values.get("subject") == body and "estimator" in status.values


def _uses(report: NodeStatus) -> dict[str, str]:
    """Text on each IMU that a fusion's report mentions, by segment."""
    values = report.values.items()
    if report.name == FUSE_STATUS:
        lines = [line.removeprefix("IMU ") for _, line in values if line.startswith("IMU ")]
    else:
        lines = [line for key, line in values if key.startswith("imu/")]
    uses = dict(line.split(": ", 1) for line in lines)
    return {name: text for name, text in uses.items() if text.startswith(("used", NOT_USED))}


def _unmentioned(bag: BagReader, name: str, topic: str) -> str:
    if name not in SEGMENTS:
        why = f"{topic} names no segment: record it as imu_<segment>/data"
    elif not bag.topics[topic].count:
        why = f"{topic} has no messages: check its battery and radio"
    else:
        why = "the fusion has not mentioned it: is use_imus true, and did it come in time?"
    return f"{NOT_USED}, {why}"
