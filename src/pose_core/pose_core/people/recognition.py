"""Re-identification of people after absences and encounters, by body size.

Somebody who has just left is recognised by size and by how far they can have come; later by size
alone. After each return, and at intervals, the size is measured again and compared with the known
one: who is clearly smaller or larger is another person.
"""

from collections.abc import Sequence

import numpy as np

from pose_core.counters import Counters
from pose_core.people.assignment import assign
from pose_core.people.body_size import BodySize
from pose_core.people.distances import centre
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.streams.samples import FloatArray, SkeletonSample

JUST_LEFT_S = 6.0  # [s] for which a place says something of who comes back
REACH_M, REACH_SPEED = 0.7, 2.0  # [m] and [m/s]: how far one may have come
SAME_SIZE = 3.2  # [-] disagreement of the sizes of one person who has just left
SAME_SIZE_LATER = 2.0  # [-] the same, of one who left long ago
OTHER_SIZE = 2.4  # [-] disagreement on which somebody in sight is somebody else
EXCHANGED = 1.5  # [-] by which two sizes must agree better with each other's person
UNKNOWN_SIZE = 0.9  # [-] in place of a disagreement that is not known
KNOWN_ID = 0.5  # [-] by which an id that a sensor gave them speaks for a person
WINDOW_S = 1.5  # [s] of measurements that are compared with what is known
WINDOW_MEASUREMENTS = 30  # [-] at least
WINDOWS = 2  # [-] in a row, that have to speak against somebody who never left
SETTLED = 120  # [-] measurements
REMEMBERED = 12  # [-] persons who left


class Recognition:
    """Compares people with those who are known.

    Args:
        counters: Of the tracker.
    """

    def __init__(self, counters: Counters) -> None:
        self._counters = counters
        self._doubts: dict[int, int] = {}  # windows in a row that spoke against a person

    def recognise(
        self, ripe: Sequence[PersonTrack], away: Sequence[PersonTrack], stamp_ns: int
    ) -> list[tuple[PersonTrack, PersonTrack | None]]:
        """Match newcomers with people who are away; ``None``: somebody new."""
        cost = np.array([[self._cost(n, a, stamp_ns) for a in away] for n in ripe])
        known = dict(assign(cost.reshape(len(ripe), len(away))))
        return [(track, away[known[i]] if i in known else None) for i, track in enumerate(ripe)]

    def _cost(self, newcomer: PersonTrack, away: PersonTrack, stamp_ns: int) -> float:
        """Cost of the hypothesis that both are one person [-]; infinite: they are two."""
        off = newcomer.size.disagreement(away.size)
        gone_s = (newcomer.born_ns - away.last_seen_ns) * 1e-9
        has_just_left = gone_s < JUST_LEFT_S
        if off > (SAME_SIZE if has_just_left else SAME_SIZE_LATER):
            return float("inf")
        cost = UNKNOWN_SIZE if np.isnan(off) else off
        if has_just_left:
            way = float(np.linalg.norm(centre(newcomer.positions) - centre(away.positions)))
            cost += way / (REACH_M + REACH_SPEED * max(gone_s, 0.0))
        same_id = any(
            name in away.views and away.views[name].person == view.person
            for name, view in newcomer.views.items()
        )
        return cost - KNOWN_ID * same_id

    def is_within_reach(self, away: PersonTrack, joints: FloatArray, stamp_ns: int) -> bool:
        """Whether the only known person can have come here since they were last seen."""
        gone_s = (stamp_ns - away.last_seen_ns) * 1e-9
        way = float(np.linalg.norm(centre(joints) - centre(away.positions)))
        return gone_s < JUST_LEFT_S and way < REACH_M + REACH_SPEED * max(gone_s, 0.0)

    def welcome(self, track: PersonTrack, joints: FloatArray, stamp_ns: int) -> None:
        """Mark somebody as back, with doubt until their size has been compared."""
        self._counters.add("came_back")
        track.presence = Presence.PRESENT
        track.move(stamp_ns, joints, anew=True)
        track.recent_size, track.returned_ns = BodySize(), stamp_ns
        self._doubts[track.number] = WINDOWS

    def return_as(self, known: PersonTrack, newcomer: PersonTrack, stamp_ns: int) -> None:
        """Continue a known person's track with a newcomer's."""
        self.welcome(known, newcomer.positions, stamp_ns)
        known.velocity = newcomer.velocity
        known.views = {**known.views, **newcomer.views}
        known.last_seen_ns = newcomer.last_seen_ns
        known.recent_size = newcomer.size

    def settle(self, track: PersonTrack) -> None:
        """Drop the recent size and the doubts of somebody who has left."""
        track.recent_size = None
        self._doubts.pop(track.number, None)

    def measure(self, track: PersonTrack, sample: SkeletonSample, stamp_ns: int) -> bool:
        """Add a measurement of a person in view; returns whether they are somebody else."""
        if track.recent_size is None:
            track.recent_size, track.returned_ns = BodySize(), stamp_ns
        track.recent_size.add(sample)
        too_early = stamp_ns - track.returned_ns < WINDOW_S * 1e9
        if too_early or track.recent_size.measurements < WINDOW_MEASUREMENTS:
            return False
        off = track.recent_size.disagreement(track.size)
        if off > OTHER_SIZE:
            self._doubts[track.number] = self._doubts.get(track.number, 0) + 1
            if self._doubts[track.number] >= WINDOWS:
                return True
        else:
            track.size.merge(track.recent_size)
            self._doubts.pop(track.number, None)
        track.recent_size = None
        return False

    def doubt(self, track: PersonTrack, stamp_ns: int) -> None:
        """Doubt somebody who has been so near to another person that both may be exchanged."""
        track.recent_size, track.returned_ns = BodySize(), stamp_ns
        self._doubts[track.number] = WINDOWS

    def are_exchanged(self, one: PersonTrack, other: PersonTrack) -> bool:
        """Whether two people who met have had each other's size since."""
        if one.recent_size is None or other.recent_size is None:
            return False
        as_they_are = one.recent_size.disagreement(one.size) + other.recent_size.disagreement(
            other.size
        )
        exchanged = one.recent_size.disagreement(other.size) + other.recent_size.disagreement(
            one.size
        )
        return bool(exchanged + EXCHANGED < as_they_are)

    def is_settled(self, track: PersonTrack) -> bool:
        """Whether a person's size is well known and not in doubt."""
        return track.size.measurements > SETTLED and track.number not in self._doubts

    def split(self, track: PersonTrack, number: int, stamp_ns: int) -> PersonTrack:
        """Split the person in view off a track, as a person of their own."""
        other = PersonTrack(
            number=number,
            presence=Presence.PRESENT,
            born_ns=track.returned_ns,
            last_seen_ns=track.last_seen_ns,
            positions=track.positions,
            velocity=track.velocity,
            size=track.recent_size or BodySize(),
            views=track.views,
            frames=track.frames,
        )
        other.move(stamp_ns, track.positions, anew=True)
        track.presence, track.views = Presence.AWAY, {}
        self.settle(track)
        return other
