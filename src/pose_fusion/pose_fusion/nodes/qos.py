"""Quality of service: the profiles of our topics, and those in a bag."""

from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from pose_core.stamps import NS_PER_S


def latched(depth: int) -> QoSProfile:
    """Reliable and transient local."""
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def sensor_data(depth: int) -> QoSProfile:
    """Best effort, as sensors publish."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


def to_bag(profile: QoSProfile) -> Qos:
    """Convert a publisher's profile to the form in a bag."""
    return Qos(
        QosHistory(int(profile.history)),
        profile.depth,
        QosReliability(int(profile.reliability)),
        QosDurability(int(profile.durability)),
        _time(profile.deadline),
        _time(profile.lifespan),
        QosLiveliness(int(profile.liveliness)),
        _time(profile.liveliness_lease_duration),
        profile.avoid_ros_namespace_conventions,
    )


def from_bag(profiles: Sequence[Qos], least_depth: int) -> QoSProfile:
    """A profile for a publisher that replaces the recorded ones.

    Args:
        profiles: Profiles of the recorded publishers.
        least_depth: Minimum length of the queue [messages].
    """
    reliable = all(profile.reliability != QosReliability.BEST_EFFORT for profile in profiles)
    latched = any(profile.durability == QosDurability.TRANSIENT_LOCAL for profile in profiles)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=max([least_depth, *(profile.depth for profile in profiles)]),
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def for_subscription(offered: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """The strictest profile that receives from all publishers, with a queue of ``depth``."""
    reliable = all(profile.reliability != ReliabilityPolicy.BEST_EFFORT for profile in offered)
    latched = all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in offered)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        liveliness=LivelinessPolicy.AUTOMATIC,
    )


def _time(duration: Duration) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, NS_PER_S))
