"""Quality of service of our topics."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def latched(depth: int) -> QoSProfile:
    """Reliable and transient local."""
    return profile(depth, is_reliable=True, is_latched=True)


def sensor_data(depth: int) -> QoSProfile:
    """Best effort, as sensors publish."""
    return profile(depth, is_reliable=False, is_latched=False)


def reliable(depth: int) -> QoSProfile:
    """Reliable and volatile."""
    return profile(depth, is_reliable=True, is_latched=False)


def profile(depth: int, *, is_reliable: bool, is_latched: bool) -> QoSProfile:
    """A profile that keeps the last ``depth`` messages."""
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )
