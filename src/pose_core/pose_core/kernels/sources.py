"""Notices when a source of information, a camera or an IMU, comes or goes."""

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled_in_place

NEVER = np.iinfo(np.int64).min  # [ns]
ABSENT_NS = 200_000_000  # [ns] of silence, after which a source that speaks is an event


@compiled_in_place
def miss(heard_ns: NDArray[np.int64], stamp_ns: int) -> bool:
    """Forget the sources that have been silent for long by an instant; whether there are any.

    Args:
        heard_ns: When each has spoken last [ns]; NEVER: it has not, or not for long.
        stamp_ns: The instant [ns].
    """
    is_any = False
    for source in range(len(heard_ns)):
        is_heard = heard_ns[source] != NEVER
        if is_heard and not 0 <= stamp_ns - heard_ns[source] <= ABSENT_NS:
            heard_ns[source] = NEVER
            is_any = True
    return is_any


@compiled_in_place
def hear(heard_ns: NDArray[np.int64], source: int, stamp_ns: int) -> bool:
    """Note that a source speaks of an instant [ns]; whether it had been silent."""
    is_new = heard_ns[source] == NEVER
    heard_ns[source] = stamp_ns
    return is_new
