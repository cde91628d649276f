"""Finds cameras that repeat one frame: a tracker never measures the same positions again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.streams.samples import SkeletonSample

STILL_FRAMES = 90  # [frames] from the start that are alike, which is suspicious
FROZEN_FRAMES = 6  # [frames] that are alike after others that were not: no tracker repeats itself


@dataclass
class _Last:
    picture: Sequence[bytes] = ()  # everybody's joints
    has_moved: bool = False
    alike: int = 0  # frames in a row with this picture


class RepeatedFrames:
    """Compares each sensor's frames with the ones before."""

    def __init__(self) -> None:
        self._last: dict[str, _Last] = {}

    def is_frozen(self, sensor: str, persons: Sequence[SkeletonSample]) -> bool:
        """Whether a sensor's next frame, with these persons, is one that it repeats on and on."""
        last = self._last.setdefault(sensor, _Last())
        picture = [person.positions.tobytes() for person in persons]
        is_alike = picture == last.picture and any(
            np.isfinite(person.positions).any() for person in persons
        )
        last.has_moved |= len(last.picture) > 0 and not is_alike
        last.alike = last.alike + 1 if is_alike else 0
        last.picture = picture
        return last.has_moved and last.alike >= FROZEN_FRAMES

    def is_still(self, sensor: str) -> bool:
        """Whether all of a sensor's frames have been alike, for long: a test, or a dead tracker."""
        last = self._last[sensor]
        return not last.has_moved and last.alike >= STILL_FRAMES
