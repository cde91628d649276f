"""Times in which no camera saw the person, and what the estimates rested on meanwhile."""

import numpy as np
from numpy.typing import NDArray

from pose_core.stamps import NS_PER_S

MIN_DURATION_S = 1.0  # [s] a shorter time is not named
LATE_START_S = 3.0  # [s] after the recording's begin, from which on the first pose is late
MAX_STEP_S = 0.1  # [s] between two estimates; a longer time is without any
BY_KINECT, BY_IMU = 1, 2  # bits of an estimate's source
ALL_OF_IT = 0.95  # [-] share of the time with estimates


def unseen_line(
    stamps_ns: NDArray[np.int64], sources: NDArray[np.uint8], begin_ns: int, end_ns: int
) -> str:
    """Describe when the poses begin, if late, and when no camera saw the person afterwards.

    Args:
        stamps_ns: Of one person's estimates, (n,) [ns].
        sources: Bits of the sources that any degree of freedom of each has, (n,).
        begin_ns: An instant [ns], from which the text counts seconds.
        end_ns: End of the recording [ns].

    Returns:
        One line; empty if there is no such time. Estimates that never rest on cameras only begin.
    """
    seen = np.flatnonzero(sources & BY_KINECT)
    first_s = (stamps_ns[0] - begin_ns) / NS_PER_S
    late = f"the first pose is of {first_s:.1f} s" if first_s > LATE_START_S else ""
    gaps = _gaps(stamps_ns, sources, seen, begin_ns, end_ns) if len(seen) else ""
    return "; ".join(filter(None, (late, gaps)))


def _gaps(
    stamps_ns: NDArray[np.int64],
    sources: NDArray[np.uint8],
    seen: NDArray[np.intp],
    begin_ns: int,
    end_ns: int,
) -> str:
    """Describe when no camera saw the person; ``seen``: the estimates that rest on cameras."""
    lengths_s = np.diff(np.append(stamps_ns[seen], max(end_ns, stamps_ns[-1]))) / NS_PER_S
    unseen = np.flatnonzero(lengths_s > MIN_DURATION_S)
    if not len(unseen):
        return ""
    longest = unseen[lengths_s[unseen].argmax()]
    total_s = lengths_s[unseen].sum()
    steps_s = np.diff(stamps_ns) / NS_PER_S
    of_unseen = np.isin(np.searchsorted(seen, np.arange(len(steps_s)), side="right") - 1, unseen)
    with_estimates = of_unseen & (steps_s <= MAX_STEP_S)
    known_s = steps_s[with_estimates].sum()
    begin_s = (stamps_ns[seen[longest]] - begin_ns) / NS_PER_S
    more = f" (and {len(unseen) - 1} more, {total_s:.1f} s in all)" if len(unseen) > 1 else ""
    by_imus = np.count_nonzero(sources[1:][with_estimates] & BY_IMU) > 0.5 * with_estimates.sum()
    held = "poses by the IMUs alone" if by_imus else "poses by prediction"
    if known_s < ALL_OF_IT * total_s:
        held += f" for {known_s:.1f} s of it, then none"
    if known_s < MAX_STEP_S:
        held = "no poses"
    when = f"for {lengths_s[longest]:.1f} s from {begin_s:.1f} s{more}"
    return f"no camera saw the person {when}: {held}"
