"""Simulated time, on ``/clock``: what is wrong with it, for the node's report."""

import time

from rclpy.clock import ROSClock

STANDSTILL_S = 1.5  # [s] after which a simulated clock is said to stand still


class SimulatedTime:
    """Watches a node's clock.

    Args:
        clock: The node's.
    """

    def __init__(self, clock: ROSClock) -> None:
        self._clock = clock
        self._seen = 0, time.monotonic()  # its last value [ns], since when [s]

    @property
    def trouble(self) -> str:
        """What is wrong with simulated time; empty if nothing is, or time is not simulated."""
        now_ns, now_s = self._clock.now().nanoseconds, time.monotonic()
        if now_ns != self._seen[0]:
            self._seen = now_ns, now_s
        if not self._clock.ros_time_is_active or now_s - self._seen[1] < STANDSTILL_S:
            return ""
        if now_ns == 0:
            return "nobody publishes /clock: ./pose play --clock, or set use_sim_time to false"
        return "/clock stands still: is the playback paused, or over?"
