"""Quality of service: the profiles of our topics, and those in a bag."""

from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
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
    return _profile(depth, is_reliable=True, is_latched=True)


def sensor_data(depth: int) -> QoSProfile:
    """Best effort, as sensors publish."""
    return _profile(depth, is_reliable=False, is_latched=False)


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
    return _profile(
        max([least_depth, *(profile.depth for profile in profiles)]),
        is_reliable=all(one.reliability != QosReliability.BEST_EFFORT for one in profiles),
        is_latched=any(one.durability == QosDurability.TRANSIENT_LOCAL for one in profiles),
    )


def for_subscription(offered: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """The strictest profile that receives from all publishers, with a queue of ``depth``."""
    return _profile(
        depth,
        is_reliable=all(one.reliability != ReliabilityPolicy.BEST_EFFORT for one in offered),
        is_latched=all(one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in offered),
    )


def _profile(depth: int, *, is_reliable: bool, is_latched: bool) -> QoSProfile:
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def _time(duration: Duration) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, NS_PER_S))
