"""Re-identification of people after absences and encounters.

That a newcomer is somebody who is absent is weighed against their being anybody else by the log
likelihood ratio of the bone lengths as each sensor measures them (:mod:`body_size`), of the
distance from where the person was last seen, of the sensors' ids, and of worn IMUs
(:mod:`wearer`). All newcomers are compared with all who are absent in one assignment, and each one
is decided upon when the next best assignment in which it is somebody else is much less likely
(Wald's sequential test).
"""

from collections.abc import Sequence

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.counters import Counters
from pose_core.finite_numbers import nan_mean
from pose_core.people.association import assign
from pose_core.people.body_size import BodySize
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.people.wearer import WearerSearch
from pose_core.streams.samples import SkeletonSample

TOGETHER_S = 0.2  # [s] in view at once, from which two tracks are of two people
JUST_LEFT_S = 6.0  # [s] for which a place says something of who comes back
REACH_M, REACH_SPEED = 0.7, 2.0  # [m] and [m/s]: how far one may have come
PLACE_M, PLACE_SPEED = 0.1, 0.7  # [m] and [m/s], standard deviation of the distance
AREA_M2 = 10.0  # [m²] in which anybody may appear
SAME_IMUS = 8.0  # [-] log ratio of IMUs that fit as they did before
SAME_ID = 1.5  # [-] log ratio of an id that a sensor gave the person
EXPECTED_NEW, EXPECTED_RETURNS = 1.0, 10.0  # [-] pseudo-counts of people before any was counted
MIN_NEW = -3.0  # [-] log ratio below which somebody new is never taken to be less likely
CERTAIN = 4.0  # [-] log ratio by which the next best assignment must be less likely
OTHER_SIZE = -6.0  # [-] log ratio at which somebody in sight is somebody else
STRANGER = -25.0  # [-] the same, if nobody who is absent is of this size either
DOUBT_MEASUREMENTS = 15  # [-] after which somebody in doubt is compared again
SWAPPED = 8.0  # [-] log ratio at which two who met were swapped, or somebody absent fits better
WINDOW_S = 1.5  # [s] of measurements that are compared with what is known
WINDOW_MEASUREMENTS = 30  # [-] at least
KNOWN_SIZE_MEASUREMENTS = 120  # [-] from which on a size is well known
MAX_ABSENT = 12  # [-] tracks that are kept


class Reidentification:
    """Compares people with those who are known."""

    def __init__(self, counters: Counters, wearer: WearerSearch) -> None:
        self._counters = counters
        self._wearer = wearer
        self._doubts: set[int] = set()  # numbers of those who came back, until they fit their size
        self.differing: set[int] = set()  # of these, those whose size has been compared

    def match(
        self, newcomers: Sequence[PersonTrack], absent: Sequence[PersonTrack]
    ) -> list[tuple[PersonTrack, PersonTrack | None, float]]:
        """Match newcomers with people who are absent.

        Returns:
            Of each newcomer: the person, ``None`` if it is somebody new, and the log ratio of
            this against the best assignment in which the newcomer is anybody else.
        """
        cost = np.full((len(newcomers), len(absent) + len(newcomers)), np.inf)
        for row, newcomer in enumerate(newcomers):
            cost[row, : len(absent)] = [self._cost(newcomer, each) for each in absent]
        np.fill_diagonal(cost[:, len(absent) :], 0.0)
        best = dict(assign(cost))
        total = _total_cost(cost, best)
        found = []
        for row, track in enumerate(newcomers):
            without = cost.copy()
            without[row, best[row]] = np.inf
            next_best = _total_cost(without, dict(assign(without)))
            person = absent[best[row]] if best[row] < len(absent) else None
            found.append((track, person, next_best - total))
        return found

    def _cost(self, newcomer: PersonTrack, absent: PersonTrack) -> float:
        """Negative log ratio of both being one person, against somebody new; infinite: too far."""
        absent_s = (newcomer.initiated_ns - absent.last_seen_ns) * 1e-9
        if absent_s < -TOGETHER_S:
            return float("inf")
        absent_s = max(0.0, absent_s)
        has_same_id = any(
            absent.is_called(view.person, sensor) for sensor, view in newcomer.views.items()
        )
        predicted = absent.predicted_centre(newcomer.initiated_ns)
        distance_m = float(np.linalg.norm(newcomer.initiated_at - predicted))
        has_just_left = absent_s <= JUST_LEFT_S
        is_out_of_reach = has_just_left and distance_m > REACH_M + REACH_SPEED * absent_s
        # Under one id a tracker may jump; somebody else's cannot.
        if is_out_of_reach and not has_same_id:
            return float("inf")
        ratio = newcomer.size.log_likelihood_ratio(absent.size) + SAME_ID * has_same_id
        ratio += SAME_IMUS * self._wearer.continues(absent.number, newcomer.number)
        anywhere = self._log_prior_of_new() - ratio
        if is_out_of_reach or not has_just_left:
            return anywhere
        most = anywhere if has_same_id else float("inf")
        spread = PLACE_M + PLACE_SPEED * absent_s
        ratio += max(0.0, float(np.log(AREA_M2 / (2.0 * np.pi * spread**2))))
        return min(most, self._log_prior_of_new() - ratio + 0.5 * (distance_m / spread) ** 2)

    def _log_prior_of_new(self) -> float:
        """Log ratio of somebody new against somebody who is absent, before any measurement.

        Estimated from how many of those who appeared were new (rule of succession): as long as
        people keep arriving, the next one is expected to be new as well.
        """
        new = self._counters["appeared"] + EXPECTED_NEW
        returns = self._counters["returned"] + EXPECTED_RETURNS
        return max(MIN_NEW, float(np.log(new / returns)))

    def is_within_reach(self, absent: PersonTrack, joints: FloatArray, stamp_ns: int) -> bool:
        """Whether the only known person can have come here since they were last seen."""
        absent_s = (stamp_ns - absent.last_seen_ns) * 1e-9
        distance_m = float(np.linalg.norm(nan_mean(joints) - nan_mean(absent.positions)))
        return absent_s < JUST_LEFT_S and distance_m < REACH_M + REACH_SPEED * max(absent_s, 0.0)

    def mark_returned(self, track: PersonTrack, joints: FloatArray, stamp_ns: int) -> None:
        """Mark somebody as back, with doubt until their size has been compared.

        Args:
            track: The person.
            joints: In the common frame, (15, 3) [m]; NaN where unknown.
            stamp_ns: The instant [ns].
        """
        self._counters.add("returned")
        track.presence = Presence.PRESENT
        track.update(stamp_ns, joints, restarts=True)
        track.restart_recent_size(stamp_ns)
        self._doubts.add(track.number)

    def resume(self, known: PersonTrack, newcomer: PersonTrack, stamp_ns: int) -> None:
        """Continue a known person's track with a newcomer's."""
        self.mark_returned(known, newcomer.positions, stamp_ns)
        known.velocity = newcomer.velocity
        known.views = {**known.views, **newcomer.views}
        known.last_seen_ns = newcomer.last_seen_ns
        known.recent_size = newcomer.size

    def drop_recent_size(self, track: PersonTrack) -> None:
        """Drop the recent size and the doubts of somebody who has left."""
        track.recent_size = None
        self._doubts.discard(track.number)
        self.differing.discard(track.number)

    def update_size(
        self,
        track: PersonTrack,
        sample: SkeletonSample,
        absent: Sequence[PersonTrack],
        stamp_ns: int,
    ) -> bool:
        """Add a measurement of a person in view.

        Returns:
            Whether they are somebody else: their size fits one of ``absent`` far better, or is far
            from their own. Hidden joints make a person's own size uncertain.
        """
        recent = track.recent_size or track.restart_recent_size(stamp_ns)
        recent.add(sample)
        too_early = stamp_ns - track.recent_since_ns < WINDOW_S * 1e9
        if too_early or recent.measurements < WINDOW_MEASUREMENTS:
            return False
        if track.number in self._doubts:
            if recent.measurements % DOUBT_MEASUREMENTS:
                return False
            ratio = recent.log_likelihood_ratio(track.size)
            if ratio < OTHER_SIZE:
                self.differing.add(track.number)
                others = [recent.log_likelihood_ratio(other.size) for other in absent]
                return ratio < STRANGER or max(others, default=ratio) > ratio + SWAPPED
            self._doubts.remove(track.number)
            self.differing.discard(track.number)
        track.size.merge(recent)
        track.recent_size = None
        return False

    def has_known_size(self, track: PersonTrack) -> bool:
        """Whether a person's size is well known and not in doubt."""
        is_in_doubt = track.number in self._doubts
        return track.size.measurements > KNOWN_SIZE_MEASUREMENTS and not is_in_doubt

    def split_off(self, track: PersonTrack, number: int, stamp_ns: int) -> PersonTrack:
        """Split the person in view off a track, as a person of their own."""
        other = PersonTrack(
            number=number,
            presence=Presence.PRESENT,
            initiated_ns=track.recent_since_ns,
            last_seen_ns=track.last_seen_ns,
            initiated_at=nan_mean(track.positions),
            positions=track.positions,
            velocity=track.velocity,
            size=track.recent_size or BodySize(),
            views=track.views,
            frames=track.frames,
        )
        other.update(stamp_ns, track.positions, restarts=True)
        track.presence, track.views = Presence.ABSENT, {}
        self.drop_recent_size(track)
        return other


def _total_cost(cost: FloatArray, pairs: dict[int, int]) -> float:
    """Sum of an assignment's costs; infinite if somebody is left over."""
    if len(pairs) < len(cost):
        return float("inf")
    return float(sum(cost[row, column] for row, column in pairs.items()))
