"""Track swaps at encounters: two who were close may have exchanged their tracks."""

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np

from pose_core.people.distances import centre
from pose_core.people.person_track import PersonTrack
from pose_core.people.recognition import WINDOW_MEASUREMENTS, Recognition

NEAR_M, APART_M = 0.7, 1.0  # [m] between the middles of two who meet, and of two who have parted


class Encounters:
    """Detects encounters, and compares both people's sizes afterwards.

    Args:
        recognition: Measures both afresh, and compares them.
    """

    def __init__(self, recognition: Recognition) -> None:
        self._recognition = recognition
        self._meeting: set[tuple[int, int]] = set()
        self._parted: set[tuple[int, int]] = set()

    def exchanged(
        self, present: Sequence[PersonTrack], stamp_ns: int
    ) -> Iterable[tuple[PersonTrack, PersonTrack]]:
        """Pairs of people in view whose tracks were swapped when they met."""
        if len(present) < 2:
            return
        middles = {track.number: centre(track.positions) for track in present}
        for one, other in combinations(present, 2):
            pair = one.number, other.number
            apart_m = float(np.linalg.norm(middles[one.number] - middles[other.number]))
            if apart_m < NEAR_M:
                self._meeting.add(pair)
                self._parted.discard(pair)
            elif apart_m > APART_M and pair in self._meeting:
                self._meeting.discard(pair)
                self._parted.add(pair)
                self._recognition.measure_anew(one, stamp_ns)
                self._recognition.measure_anew(other, stamp_ns)
            elif pair in self._parted and _are_measured(one, other):
                self._parted.discard(pair)
                if self._recognition.are_exchanged(one, other):
                    yield one, other


def _are_measured(one: PersonTrack, other: PersonTrack) -> bool:
    return all(
        each.recent_size is not None and each.recent_size.measurements >= WINDOW_MEASUREMENTS
        for each in (one, other)
    )
