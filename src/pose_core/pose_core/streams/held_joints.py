"""Finds joints that a tracker holds: it repeats them exactly while the others move.

Many trackers go on sending the last position of a joint that they have lost, some of them as
TRACKED. A measurement hardly ever repeats itself exactly (rounded positions of a joint at rest may,
for some frames), so a joint that does, and has not from the start, is no measurement: its state
becomes INFERRED, and soon NOT_TRACKED.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pose_core.joints import JOINTS, TrackingState
from pose_core.streams.samples import SkeletonSample

HELD_FRAMES = 6  # [frames] in a row with the same position, from which on a joint is INFERRED
LOST_FRAMES = 15  # [frames] from which on it is NOT_TRACKED


class HeldJoints:
    """Lowers the tracking state of joints that their sensor holds."""

    def __init__(self) -> None:
        self._last: dict[str, SkeletonSample] = {}
        # By sensor, (15,); −1: the joint has not moved yet.
        self._repeats: defaultdict[str, NDArray[np.int64]] = defaultdict(
            lambda: np.full(len(JOINTS), -1)
        )
        self.held: dict[str, Sequence[str]] = {}
        """Joints that each sensor holds in its last frame as TRACKED."""

    def checked(self, sample: SkeletonSample) -> SkeletonSample:
        """A sensor's next frame of a person, with the states of held joints lowered."""
        sensor = sample.sensor
        last, self._last[sensor] = self._last.get(sensor, sample), sample
        repeats = self._repeats[sensor]
        self.held[sensor] = []
        if not ((sample.positions == last.positions).any() or repeats.any()):
            return sample  # as usual: nothing is repeated, nothing was
        moved_m = np.abs(sample.positions - last.positions) @ np.ones(3)  # NaN where not known
        is_same, has_moved = moved_m == 0.0, moved_m > 0.0
        repeats[has_moved] = 0
        if not is_same.any():
            return sample
        if has_moved.any():  # otherwise the whole frame is repeated
            repeats[is_same & (repeats >= 0)] += 1
        is_held = is_same & (repeats >= HELD_FRAMES)
        if not is_held.any():
            return sample
        claimed = is_held & (sample.tracking_state == int(TrackingState.TRACKED))
        self.held[sensor] = [JOINTS[joint] for joint in np.flatnonzero(claimed)]
        is_lost = is_held & (repeats >= LOST_FRAMES)
        most = np.where(is_held, TrackingState.INFERRED, TrackingState.TRACKED)
        most[is_lost] = TrackingState.NOT_TRACKED
        return replace(
            sample,
            positions=np.where(is_lost[:, None], np.nan, sample.positions),
            tracking_state=np.minimum(sample.tracking_state, most).astype(np.uint8),
        )
