"""Track swaps at encounters: two who were close may have swapped tracks."""

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np

from pose_core.finite_numbers import nan_mean
from pose_core.people.person_track import PersonTrack
from pose_core.people.reidentification import SWAPPED, WINDOW_MEASUREMENTS

NEAR_M, APART_M = 0.7, 1.0  # [m] between the middles of two who meet, and of two who have parted


class TrackSwaps:
    """Detects encounters, and compares both people's sizes before and after."""

    def __init__(self) -> None:
        self._meeting: set[tuple[int, int]] = set()
        self._parted: set[tuple[int, int]] = set()

    def find(
        self, present: Sequence[PersonTrack], stamp_ns: int
    ) -> Iterable[tuple[PersonTrack, PersonTrack]]:
        """Pairs of people in view whose tracks were swapped when they met."""
        if len(present) < 2:
            return
        middles = {track.number: nan_mean(track.positions) for track in present}
        for one, other in combinations(present, 2):
            pair = one.number, other.number
            apart_m = float(np.linalg.norm(middles[one.number] - middles[other.number]))
            if apart_m < NEAR_M:
                self._meeting.add(pair)
                self._parted.discard(pair)
            elif apart_m > APART_M and pair in self._meeting:
                self._meeting.discard(pair)
                self._parted.add(pair)
                one.restart_recent_size(stamp_ns)
                other.restart_recent_size(stamp_ns)
            elif pair in self._parted and _are_measured(one, other):
                self._parted.discard(pair)
                if _are_swapped(one, other):
                    yield one, other


def _are_measured(one: PersonTrack, other: PersonTrack) -> bool:
    return all(
        each.recent_size is not None and each.recent_size.measurements >= WINDOW_MEASUREMENTS
        for each in (one, other)
    )


def _are_swapped(one: PersonTrack, other: PersonTrack) -> bool:
    """Whether two people have had each other's size since they met."""

    def likelihood(recent: PersonTrack, known: PersonTrack) -> float:
        size = recent.recent_size
        return 0.0 if size is None else size.log_likelihood_ratio(known.size)

    unchanged = likelihood(one, one) + likelihood(other, other)
    swapped = likelihood(one, other) + likelihood(other, one)
    return swapped - unchanged > SWAPPED
