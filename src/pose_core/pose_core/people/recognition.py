"""Re-identification of people after absences and encounters.

That a newcomer is somebody who is away is weighed against their being anybody else by the log
likelihood ratio of the bone lengths as each sensor measures them (:mod:`body_size`), of the way
from where the person was last seen, and of the sensors' ids. All newcomers are compared with all
who are away in one assignment, and each one is decided upon when the next best assignment in
which it is somebody else is much less likely (Wald's sequential test).
"""

from collections.abc import Sequence

import numpy as np

from pose_core.counters import Counters
from pose_core.people.assignment import assign
from pose_core.people.body_size import BodySize
from pose_core.people.distances import centre
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.streams.samples import FloatArray, SkeletonSample

TOGETHER_S = 0.2  # [s] in view at once, from which two tracks are of two people
JUST_LEFT_S = 6.0  # [s] for which a place says something of who comes back
REACH_M, REACH_SPEED = 0.7, 2.0  # [m] and [m/s]: how far one may have come
PLACE_M, PLACE_SPEED = 0.1, 0.7  # [m] and [m/s], standard deviation of the way
AREA_M2 = 10.0  # [m²] in which anybody may appear
SAME_ID = 1.5  # [-] log ratio of an id that a sensor gave the person
EXPECTED_NEW, EXPECTED_RETURNS = 1.0, 10.0  # [-] pseudo-counts of people before any was counted
LEAST_NEW = -3.0  # [-] log ratio below which somebody new is never taken to be less likely
CERTAIN = 4.0  # [-] log ratio by which the next best assignment must be less likely
OTHER_SIZE = -6.0  # [-] log ratio at which somebody in sight is somebody else
STRANGER = -25.0  # [-] the same, if nobody who is away is of this size either
DOUBT_MEASUREMENTS = 15  # [-] after which somebody in doubt is compared again
EXCHANGED = 8.0  # [-] log ratio at which two who met are exchanged, or somebody away fits better
WINDOW_S = 1.5  # [s] of measurements that are compared with what is known
WINDOW_MEASUREMENTS = 30  # [-] at least
SETTLED = 120  # [-] measurements
REMEMBERED = 12  # [-] persons who left


class Recognition:
    """Compares people with those who are known."""

    def __init__(self, counters: Counters) -> None:
        self._counters = counters
        self._doubts: set[int] = set()  # numbers of those who came back and are not measured yet

    def recognise(
        self, newcomers: Sequence[PersonTrack], away: Sequence[PersonTrack]
    ) -> list[tuple[PersonTrack, PersonTrack | None, float]]:
        """Match newcomers with people who are away.

        Returns:
            Of each newcomer: the person, ``None`` if it is somebody new, and the log ratio of
            this against the best assignment in which the newcomer is anybody else.
        """
        cost = np.full((len(newcomers), len(away) + len(newcomers)), np.inf)
        for row, newcomer in enumerate(newcomers):
            cost[row, : len(away)] = [self._cost(newcomer, each) for each in away]
        np.fill_diagonal(cost[:, len(away) :], 0.0)
        best = dict(assign(cost))
        total = _sum(cost, best)
        found = []
        for row, track in enumerate(newcomers):
            without = cost.copy()
            without[row, best[row]] = np.inf
            next_best = _sum(without, dict(assign(without)))
            person = away[best[row]] if best[row] < len(away) else None
            found.append((track, person, next_best - total))
        return found

    def _cost(self, newcomer: PersonTrack, away: PersonTrack) -> float:
        """Negative log ratio of both being one person, against somebody new; infinite: too far."""
        gone_s = (newcomer.born_ns - away.last_seen_ns) * 1e-9
        if gone_s < -TOGETHER_S:
            return float("inf")
        gone_s = max(0.0, gone_s)
        has_same_id = any(
            name in away.views and away.views[name].person == view.person
            for name, view in newcomer.views.items()
        )
        way = float(np.linalg.norm(newcomer.born_at - away.expected_centre(newcomer.born_ns)))
        has_just_left = gone_s <= JUST_LEFT_S
        is_out_of_reach = has_just_left and way > REACH_M + REACH_SPEED * gone_s
        # Under one id a tracker may jump; somebody else's cannot.
        if is_out_of_reach and not has_same_id:
            return float("inf")
        ratio = newcomer.size.log_likelihood_ratio(away.size) + SAME_ID * has_same_id
        anywhere = self._new_person() - ratio
        if is_out_of_reach or not has_just_left:
            return anywhere
        most = anywhere if has_same_id else float("inf")
        spread = PLACE_M + PLACE_SPEED * gone_s
        ratio += max(0.0, float(np.log(AREA_M2 / (2.0 * np.pi * spread**2))))
        return min(most, self._new_person() - ratio + 0.5 * (way / spread) ** 2)

    def _new_person(self) -> float:
        """Log ratio of somebody new against somebody who is away, before any measurement.

        Estimated from how many of those who appeared were new (rule of succession): as long as
        people keep arriving, the next one is expected to be new as well.
        """
        new = self._counters["came"] + EXPECTED_NEW
        returns = self._counters["came_back"] + EXPECTED_RETURNS
        return max(LEAST_NEW, float(np.log(new / returns)))

    def is_within_reach(self, away: PersonTrack, joints: FloatArray, stamp_ns: int) -> bool:
        """Whether the only known person can have come here since they were last seen."""
        gone_s = (stamp_ns - away.last_seen_ns) * 1e-9
        way = float(np.linalg.norm(centre(joints) - centre(away.positions)))
        return gone_s < JUST_LEFT_S and way < REACH_M + REACH_SPEED * max(gone_s, 0.0)

    def mark_returned(self, track: PersonTrack, joints: FloatArray, stamp_ns: int) -> None:
        """Mark somebody as back, with doubt until their size has been compared."""
        self._counters.add("came_back")
        track.presence = Presence.PRESENT
        track.move(stamp_ns, joints, anew=True)
        track.recent_size, track.returned_ns = BodySize(), stamp_ns
        self._doubts.add(track.number)

    def return_as(self, known: PersonTrack, newcomer: PersonTrack, stamp_ns: int) -> None:
        """Continue a known person's track with a newcomer's."""
        self.mark_returned(known, newcomer.positions, stamp_ns)
        known.velocity = newcomer.velocity
        known.views = {**known.views, **newcomer.views}
        known.last_seen_ns = newcomer.last_seen_ns
        known.recent_size = newcomer.size

    def settle(self, track: PersonTrack) -> None:
        """Drop the recent size and the doubts of somebody who has left."""
        track.recent_size = None
        self._doubts.discard(track.number)

    def measure(
        self,
        track: PersonTrack,
        sample: SkeletonSample,
        away: Sequence[PersonTrack],
        stamp_ns: int,
    ) -> bool:
        """Add a measurement of a person in view.

        Returns:
            Whether they are somebody else: their size fits one of ``away`` far better, or is far
            from their own. Hidden joints make a person's own size uncertain.
        """
        if track.recent_size is None:
            track.recent_size, track.returned_ns = BodySize(), stamp_ns
        recent = track.recent_size
        recent.add(sample)
        too_early = stamp_ns - track.returned_ns < WINDOW_S * 1e9
        if too_early or recent.measurements < WINDOW_MEASUREMENTS:
            return False
        if track.number in self._doubts:
            if recent.measurements % DOUBT_MEASUREMENTS:
                return False
            ratio = recent.log_likelihood_ratio(track.size)
            if ratio < OTHER_SIZE:
                others = [recent.log_likelihood_ratio(other.size) for other in away]
                return ratio < STRANGER or max(others, default=ratio) > ratio + EXCHANGED
            self._doubts.remove(track.number)
        track.size.merge(recent)
        track.recent_size = None
        return False

    def measure_anew(self, track: PersonTrack, stamp_ns: int) -> None:
        """Measure somebody afresh who has been so near to another that both may be exchanged."""
        track.recent_size, track.returned_ns = BodySize(), stamp_ns

    def are_exchanged(self, one: PersonTrack, other: PersonTrack) -> bool:
        """Whether two people who met have had each other's size since."""
        if one.recent_size is None or other.recent_size is None:
            return False
        as_they_are = one.recent_size.log_likelihood_ratio(
            one.size
        ) + other.recent_size.log_likelihood_ratio(other.size)
        exchanged = one.recent_size.log_likelihood_ratio(
            other.size
        ) + other.recent_size.log_likelihood_ratio(one.size)
        return exchanged - as_they_are > EXCHANGED

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
            born_at=centre(track.positions),
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


def _sum(cost: FloatArray, pairs: dict[int, int]) -> float:
    """Sum of an assignment's costs; infinite if somebody is left over."""
    if len(pairs) < len(cost):
        return float("inf")
    return float(sum(cost[row, column] for row, column in pairs.items()))
