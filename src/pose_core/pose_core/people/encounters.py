"""People who come close: duplicate tracks of one person, and tracks that are swapped.

A duplicate is a tracker's ghost, or a second sensor's view.
"""

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np

from pose_core.finite_numbers import nan_mean
from pose_core.people.association import joint_distances
from pose_core.people.person_track import PersonTrack
from pose_core.people.reidentification import SWAPPED, WINDOW_MEASUREMENTS

DUPLICATE_M = 0.25  # [m] mean distance of the joints: nearer than two bodies can be
COINCIDENT_M = 0.2  # [m]
COINCIDENT_FOR_S = 0.5  # [s]
VIEW_HOLDS_S = 0.3  # [s] since its last frame of them, a sensor sees a person
NEAR_M, APART_M = 0.7, 1.0  # [m] between the middles of two who meet, and of two who have parted


class DuplicateTracks:
    """Finds tracks of one and the same person."""

    def __init__(self) -> None:
        self._since_ns: dict[tuple[int, int], int] = {}

    def find(
        self, present: Sequence[PersonTrack], stamp_ns: int
    ) -> Iterable[tuple[PersonTrack, PersonTrack]]:
        """Pairs of tracks (younger, older) that coincide and that no sensor separates."""
        since_ns: dict[tuple[int, int], int] = {}
        coincident = []
        for index, younger in enumerate(present):
            for older in present[:index]:
                key = younger.number, older.number
                apart_m = distance(younger, older, stamp_ns)
                if apart_m > COINCIDENT_M or _seen_apart(younger, older, stamp_ns):
                    continue
                since_ns[key] = min(self._since_ns.get(key, stamp_ns), stamp_ns)
                if stamp_ns - since_ns[key] > COINCIDENT_FOR_S * 1e9:
                    coincident.append((younger, older))
                    break
        self._since_ns = since_ns
        return coincident


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
            elif pair in self._parted and all(
                each.recent_size and each.recent_size.measurements >= WINDOW_MEASUREMENTS
                for each in (one, other)
            ):
                self._parted.discard(pair)
                if _are_swapped(one, other):
                    yield one, other


def _are_swapped(one: PersonTrack, other: PersonTrack) -> bool:
    """Whether two people have had each other's size since they met."""

    def likelihood(recent: PersonTrack, known: PersonTrack) -> float:
        size = recent.recent_size
        return 0.0 if size is None else size.log_likelihood_ratio(known.size)

    unchanged = likelihood(one, one) + likelihood(other, other)
    swapped = likelihood(one, other) + likelihood(other, one)
    return swapped - unchanged > SWAPPED


def distance(one: PersonTrack, other: PersonTrack, stamp_ns: int) -> float:
    """Mean distance of two tracks' joints, as predicted to an instant [m]."""
    places = (track.predicted(stamp_ns)[None] for track in (one, other))
    return float(joint_distances(*places)[0][0, 0])


def _seen_apart(one: PersonTrack, other: PersonTrack, stamp_ns: int) -> bool:
    """Whether one sensor sees both."""
    sensors = [
        {name for name, view in t.views.items() if stamp_ns - view.stamp_ns < VIEW_HOLDS_S * 1e9}
        for t in (one, other)
    ]
    return bool(sensors[0] & sensors[1])
