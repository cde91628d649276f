"""Quality of service of topics in a bag, and of those of others."""

from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from pose_core.stamps import NS_PER_S
from pose_node.nodes.qos import profile


def to_bag(own: QoSProfile) -> Qos:
    """Convert a publisher's profile to the form in a bag."""
    return Qos(
        QosHistory(int(own.history)),
        own.depth,
        QosReliability(int(own.reliability)),
        QosDurability(int(own.durability)),
        _time(own.deadline),
        _time(own.lifespan),
        QosLiveliness(int(own.liveliness)),
        _time(own.liveliness_lease_duration),
        own.avoid_ros_namespace_conventions,
    )


def from_bag(profiles: Sequence[Qos], least_depth: int) -> QoSProfile:
    """A profile for a publisher that replaces the recorded ones.

    Args:
        profiles: Profiles of the recorded publishers.
        least_depth: Minimum length of the queue [messages].
    """
    return profile(
        max([least_depth, *(one.depth for one in profiles)]),
        is_reliable=all(one.reliability != QosReliability.BEST_EFFORT for one in profiles),
        is_latched=any(one.durability == QosDurability.TRANSIENT_LOCAL for one in profiles),
    )


def for_subscription(offered: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """The strictest profile that receives from all publishers, with a queue of ``depth``."""
    return profile(
        depth,
        is_reliable=all(one.reliability != ReliabilityPolicy.BEST_EFFORT for one in offered),
        is_latched=all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in offered),
    )


def _time(duration: Duration) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, NS_PER_S))
