"""A pose that never jumps: a large correction is taken over gradually.

When a sensor comes or goes, a limb is found elsewhere or the filter starts anew, the state jumps.
What goes out then keeps its place and glides to the state: the difference, beyond a little that
may show at once, decays. Corrections at other times are quick movements: they show at once, but for
what no person does. Late frames correct without anything going out: what may show is counted from
one pose that goes out to the next.
"""

from collections.abc import Iterable
from math import exp

import numpy as np

from pose_common.stamps import NS_PER_S
from pose_fusion.kernels.compiling import settled
from pose_fusion.kernels.gliding import Glide, Limits, take_up
from pose_fusion.kernels.placing import Pose

DECAY_S = 0.12  # [s] time constant of the glide
EVENT_NS = NS_PER_S // 10  # [ns] for which an event's corrections come
ABSENT_NS = NS_PER_S // 5  # [ns] of silence, after which a source that speaks is an event
AFTER_AN_EVENT = Limits(
    turn=float(np.radians(2.0)), turn_time_s=0.03, shift=0.02, shift_time_s=0.03
)
"""What one update may correct at once, after an event."""
EVER_LARGER = 12.0  # [-] times as much at other times
AT_OTHER_TIMES = Limits(*(EVER_LARGER * limit for limit in AFTER_AN_EVENT))


class Sources:
    """Notices when a source of information, a camera or an IMU, comes or goes."""

    def __init__(self) -> None:
        self._heard_ns: dict[str, int] = {}
        self._event_ns: int | None = None

    def is_eventful(self, stamp_ns: int, names: Iterable[str], event: bool) -> bool:
        """Whether an event is so recent that its corrections still come.

        Args:
            stamp_ns: The instant.
            names: Sources that speak of it.
            event: Whether something else has just happened.
        """
        gone = [n for n, ns in self._heard_ns.items() if not 0 <= stamp_ns - ns <= ABSENT_NS]
        for name in gone:
            del self._heard_ns[name]
        new = [name for name in names if name not in self._heard_ns]
        self._heard_ns.update(dict.fromkeys(names, stamp_ns))
        if event or gone or new:
            self._event_ns = stamp_ns
        return self._event_ns is not None and 0 <= stamp_ns - self._event_ns <= EVENT_NS


class Handover:
    """Follows a filter's states without their jumps.

    Args:
        links: Number of the body's links.
    """

    def __init__(self, links: int) -> None:
        self._links = links
        self._take_up = settled(take_up)
        self._glide = no_glide(links)
        self._gone_s = 0.0  # [s] since that changed last
        self._at_once = np.zeros(links + 1)  # [rad], [m] corrections since a pose went out

    def predict(self, dt_s: float) -> None:
        """Glide on for ``dt_s`` [s]."""
        self._gone_s += dt_s

    def follow(self, before: Pose | None, after: Pose, eventful: bool) -> None:
        """Take up a correction.

        Args:
            before: The pose as predicted, just before; None: nothing has gone out yet.
            after: The corrected pose of the same instant.
            eventful: Whether something has just happened that makes the state jump.
        """
        keep, self._gone_s = exp(-self._gone_s / DECAY_S), 0.0
        if before is None:
            self._glide = no_glide(self._links)
            return
        limits = AFTER_AN_EVENT if eventful else AT_OTHER_TIMES
        self._take_up(before, after, limits, keep, self._glide, self._at_once)

    def show(self) -> Glide:
        """What lies between the state and what goes out now."""
        self._at_once[:] = 0.0
        return self.ahead(0.0)

    def ahead(self, dt_s: float) -> Glide:
        """The same ``dt_s`` [s] later; nothing goes out."""
        gone_s = self._gone_s + dt_s
        if gone_s == 0.0:
            return self._glide
        keep = exp(-gone_s / DECAY_S)
        return Glide(keep * self._glide.turns, keep * self._glide.shift)


def no_glide(links: int) -> Glide:
    """What goes out is the state."""
    return Glide(np.zeros((links, 3)), np.zeros(3))
