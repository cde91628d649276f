"""Duplicate tracks of one person: a tracker's ghost, or a second sensor's view."""

from collections.abc import Iterator, Sequence

from pose_core.people.distances import joint_distances
from pose_core.people.person_track import PersonTrack

DUPLICATE_M = 0.25  # [m] mean distance of the joints: nearer than two bodies can be
COINCIDENT_M = 0.2  # [m]
COINCIDENT_FOR_S = 0.5  # [s]
VIEW_HOLDS_S = 0.3  # [s] since its last frame of them, a sensor sees a person


class DuplicateTracks:
    """Finds tracks of one and the same person."""

    def __init__(self) -> None:
        self._since_ns: dict[tuple[int, int], int] = {}

    def is_duplicate(
        self, track: PersonTrack, present: Sequence[PersonTrack], stamp_ns: int
    ) -> bool:
        """Whether a new track coincides with one in view."""
        place = track.predicted(stamp_ns)[None]
        return any(
            joint_distances(other.predicted(stamp_ns)[None], place)[0][0, 0] < DUPLICATE_M
            for other in present
        )

    def find(
        self, present: Sequence[PersonTrack], stamp_ns: int
    ) -> Iterator[tuple[PersonTrack, PersonTrack]]:
        """Pairs of tracks (younger, older) that coincide and that no sensor separates."""
        since_ns: dict[tuple[int, int], int] = {}
        coincident = []
        for index, younger in enumerate(present):
            for older in present[:index]:
                key = younger.number, older.number
                distance, _ = joint_distances(
                    younger.predicted(stamp_ns)[None], older.predicted(stamp_ns)[None]
                )
                if distance[0, 0] > COINCIDENT_M or _seen_apart(younger, older, stamp_ns):
                    continue
                since_ns[key] = min(self._since_ns.get(key, stamp_ns), stamp_ns)
                if stamp_ns - since_ns[key] > COINCIDENT_FOR_S * 1e9:
                    coincident.append((younger, older))
                    break
        self._since_ns = since_ns
        return iter(coincident)


def _seen_apart(one: PersonTrack, other: PersonTrack, stamp_ns: int) -> bool:
    """Whether one sensor sees both."""
    sensors = [
        {name for name, view in t.views.items() if stamp_ns - view.stamp_ns < VIEW_HOLDS_S * 1e9}
        for t in (one, other)
    ]
    return bool(sensors[0] & sensors[1])
