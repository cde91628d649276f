"""Which of the persons that a sensor sees is the one to follow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import FloatArray, SkeletonSample

REACH_M = 0.8  # [m] farther than this from where they were, it is somebody else
FORGET_S = 2.0  # [s] after this long, anybody may be the person again


@dataclass
class _Followed:
    person: str
    seen: FloatArray  # (15, 3) [m] in the sensor's frame, when any joint was last known
    stamp_ns: int


class PersonSelector:
    """Follows one person in each sensor's frames.

    A given id is followed and nobody else. Otherwise it is the person of the sensor's first frame
    with anybody in it (the first of the list): while the sensor keeps their id, by that; when it
    gives a new one, whoever is nearest to where they were, within 0.8 m. Two seconds without them,
    and whoever is seen first is followed.

    Args:
        person: The id to follow; empty for the rule above.
    """

    def __init__(self, person: str = "") -> None:
        self._person = person
        self._followed: dict[str, _Followed] = {}
        self.counters = Counters("nobody_seen", "followed", "other_person", "person_changed")

    def follow(self, person: str) -> None:
        """From now on follow this id; empty for the rule above."""
        self._person = person
        self._followed.clear()

    def select(self, persons: Sequence[SkeletonSample]) -> SkeletonSample | None:
        """The person to follow, of all that one sensor saw in one frame, or None."""
        if not persons:
            self.counters.add("nobody_seen")
            return None
        chosen = self._choose(persons)
        self.counters.add("other_person", len(persons) - (chosen is not None))
        if chosen is None:
            return None
        self.counters.add("followed")
        known = self._followed.get(chosen.sensor)
        if known is not None and known.person != chosen.person:
            self.counters.add("person_changed")
        seen = chosen.positions
        if known is not None and not np.isfinite(seen[:, 0]).any():
            seen = known.seen
        self._followed[chosen.sensor] = _Followed(chosen.person, seen, chosen.stamp_ns)
        return chosen

    def _choose(self, persons: Sequence[SkeletonSample]) -> SkeletonSample | None:
        if self._person:
            return next((p for p in persons if p.person == self._person), None)
        known = self._followed.get(persons[0].sensor)
        if known is None or abs(persons[0].stamp_ns - known.stamp_ns) > FORGET_S * NS_PER_S:
            return persons[0]
        for candidate in persons:
            if candidate.person == known.person:
                return candidate
        centre = _centre(known.seen)
        distances = [float(np.linalg.norm(_centre(p.positions) - centre)) for p in persons]
        distances = [np.inf if np.isnan(d) else d for d in distances]
        nearest = int(np.argmin(distances))
        return persons[nearest] if distances[nearest] <= REACH_M else None


def _centre(positions: FloatArray) -> FloatArray:
    known = np.isfinite(positions).all(axis=1)
    return positions[known].mean(axis=0) if known.any() else np.full(3, np.nan)
