"""A pose that never jumps: a large correction is taken over gradually.

When a sensor comes or goes, a limb is found elsewhere or the filter starts anew, the state jumps.
What goes out then keeps its place and glides to the state: the difference, beyond a little that
may show at once, decays. Corrections at other times are quick movements: they show at once, but for
what no person does. Late frames correct without anything going out: what may show is counted from
one pose that goes out to the next.
"""

from typing import NamedTuple

import numpy as np

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.gliding import Glide, Limits, take_up
from pose_core.kernels.placing import Pose
from pose_core.streams.samples import FloatArray

DECAY_S = 0.12  # [s] time constant of the glide
TURN = np.radians(2.0)  # [rad] that one update may correct at once, after an event
TURN_TIME_S = 0.03  # [s] of a link's own rate, by which that may be more
SHIFT = 0.02  # [m] likewise of the root
SHIFT_TIME_S = 0.03  # [s]
EVER_LARGER = 12.0  # [-] times as much at other times


class Handover(NamedTuple):
    """What goes out, against the state."""

    glide: Glide
    gone_s: FloatArray  # (1,) [s] since that changed last
    at_once: FloatArray  # (links + 1,) [rad], [m] corrections since a pose went out


def make_handover(links: int) -> Handover:
    """What goes out is the state."""
    glide = Glide(np.zeros((links, 3)), np.zeros(3))
    return Handover(glide=glide, gone_s=np.zeros(1), at_once=np.zeros(links + 1))


@compiled
def glide_on(handover: Handover, before: Pose, after: Pose, is_eventful: bool) -> None:
    """Take up a correction.

    Args:
        handover: What glides.
        before: The pose as predicted, just before, or as it went out.
        after: The corrected pose of the same instant.
        is_eventful: Whether something has just happened that makes the state jump.
    """
    more = 1.0 if is_eventful else EVER_LARGER
    limits = Limits(more * TURN, more * TURN_TIME_S, more * SHIFT, more * SHIFT_TIME_S)
    keep = np.exp(-handover.gone_s[0] / DECAY_S)
    handover.gone_s[0] = 0.0
    take_up(before, after, limits, keep, handover.glide, handover.at_once)


@compiled_in_place
def glide_no_more(handover: Handover) -> None:
    """Nothing has gone out yet that anything could glide from."""
    handover.gone_s[0] = 0.0
    for axis in range(3):
        handover.glide.shift[axis] = 0.0
        for link in range(len(handover.glide.turns)):
            handover.glide.turns[link, axis] = 0.0


def glide_after(handover: Handover, dt_s: float) -> Glide:
    """What still glides after some time [s]; everything stays as it is."""
    keep = float(np.exp(-(handover.gone_s[0] + dt_s) / DECAY_S))
    return Glide(keep * handover.glide.turns, keep * handover.glide.shift)
