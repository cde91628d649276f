"""Which joints no camera tracks: their angles rest on neighbours, posture and IMUs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.joints import JOINTS, TrackingState

MIN_SHARE = 0.02  # [-] of all cameras' skeletons in which a joint has to be tracked
MIN_SKELETONS = 60  # [-] from which on this is judged


class TrackedJoints:
    """Counts in how many skeletons of all cameras each joint is tracked."""

    def __init__(self) -> None:
        self._tracked = np.zeros(len(JOINTS), np.int64)
        self._skeletons = 0

    def add(self, tracking_state: NDArray[np.uint8]) -> None:
        """Add skeletons by their joints' states, (15,) or (n, 15)."""
        states = tracking_state.reshape(-1, len(JOINTS))
        self._tracked += (states == int(TrackingState.TRACKED)).sum(axis=0)
        self._skeletons += len(states)

    @property
    def missing(self) -> Sequence[str]:
        """Names of the joints that are hardly ever tracked."""
        if self._skeletons < MIN_SKELETONS:
            return ()
        is_missing = self._tracked < MIN_SHARE * self._skeletons
        return tuple(JOINTS[joint] for joint in np.flatnonzero(is_missing))
