"""Track management: begins, confirms and ends the tracks of persons.

Somebody new is tentative first: trackers show ghosts for moments. Who is not seen for a while is
away, and is compared with everybody who comes later (:mod:`recognition`).
"""

import numpy as np

from pose_core.counters import Counters
from pose_core.people.distances import centre
from pose_core.people.doubles import Doubles
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.people.recognition import CERTAIN, REMEMBERED, Recognition
from pose_core.streams.samples import FloatArray, SkeletonSample

AWAY_AFTER_S = 0.35  # [s] unseen by all sensors, a person is away
CONFIRMED_AFTER_S = 0.3  # [s] in view: shorter ones are trackers' ghosts
RETURN_WITHIN_S = 4.0  # [s] in view, after which the likelier hypothesis is accepted
NEW_WITHIN_S = 8.0  # [s] the same for somebody new, while somebody who is away may be the same
NEW_MEASUREMENTS = 60  # [-] skeletons of somebody new: a glimpse does not give a size
CONFIRMED_FRAMES = 5  # [-] the same in frames
GHOST_AFTER_S = 0.8  # [s] unseen, a tentative person was a ghost
MOST_TENTATIVE = 12  # [-] at a time; of ghosts all over the place, the others are left out
JUMP_BACK_S = 1.0  # [s] further back than this, a recording has begun anew

Assigned = tuple[int, SkeletonSample]
"""A person's number and a skeleton of theirs."""


class Tracks:
    """Everybody who is known.

    Args:
        counters: Of the tracker.
        recognition: Compares people with those who are away.
        doubles: Finds tracks that are of one person.

    Attributes:
        everybody: All tracks, in the order in which they began.
        newest_ns: Stamp of the newest frame [ns], on the reference's clock.
    """

    def __init__(self, counters: Counters, recognition: Recognition, doubles: Doubles) -> None:
        self.everybody: list[PersonTrack] = []
        self.newest_ns = 0
        self._counters = counters
        self._recognition = recognition
        self._doubles = doubles
        self._next_number = 1

    def of(self, *presences: Presence) -> list[PersonTrack]:
        """The tracks of these presences."""
        return [track for track in self.everybody if track.presence in presences]

    @property
    def present(self) -> list[PersonTrack]:
        """Everybody in view, in the order in which they came."""
        return self.of(Presence.PRESENT)

    @property
    def in_view(self) -> list[PersonTrack]:
        """Everybody in view, tentative ones too."""
        return self.of(Presence.PRESENT, Presence.TENTATIVE)

    def age(self, stamp_ns: int) -> None:
        """Go on to a frame's instant [ns]: end the tracks that have not been seen for long."""
        if stamp_ns < self.newest_ns - JUMP_BACK_S * 1e9:
            for track in list(self.everybody):
                self.mark_absent(track)
                track.last_seen_ns = stamp_ns
            self.newest_ns = stamp_ns
        self.newest_ns = max(self.newest_ns, stamp_ns)
        for track in list(self.everybody):
            unseen_s = track.unseen_s(stamp_ns)
            if track.presence is Presence.PRESENT and unseen_s > AWAY_AFTER_S:
                self.mark_absent(track)
            elif track.presence is Presence.TENTATIVE and unseen_s > GHOST_AFTER_S:
                self._remove(track, "ghosts")

    def mark_absent(self, track: PersonTrack) -> None:
        """Mark somebody in view as away; who left longest ago may be forgotten."""
        if track.presence is Presence.PRESENT:
            track.presence = Presence.AWAY
            self._recognition.settle(track)
            self._counters.add("went_away")
            away = self.of(Presence.AWAY)
            if len(away) > REMEMBERED:
                self.everybody.remove(min(away, key=lambda each: each.last_seen_ns))

    def begin(
        self, sample: SkeletonSample, joints: FloatArray, stamp_ns: int, is_alone: bool
    ) -> list[Assigned]:
        """Begin the track of somebody new.

        Args:
            sample: Their first skeleton.
            joints: Its joints in the common frame [m], shape (15, 3).
            stamp_ns: Its stamp on the reference's clock [ns].
            is_alone: Whether it is the only skeleton of its frame.

        Returns:
            The skeleton, if nobody else is known; otherwise it is held until they are confirmed.
        """
        if len(self.of(Presence.TENTATIVE)) >= MOST_TENTATIVE:
            self._counters.add("too_many")
            return []
        track = PersonTrack(
            number=self._new_number(),
            presence=Presence.TENTATIVE,
            born_ns=stamp_ns,
            last_seen_ns=stamp_ns,
            born_at=centre(joints),
            positions=np.full_like(joints, np.nan),
        )
        track.move(stamp_ns, joints, anew=True)
        track.note(sample, stamp_ns)
        track.size.add(sample)
        self.everybody.append(track)
        if is_alone and len(self.everybody) == 1:
            track.presence = Presence.PRESENT
            self._counters.add("came")
            return [(track.number, sample)]
        track.held.append(sample)
        return []

    def take_over(self, track: PersonTrack, stamp_ns: int) -> PersonTrack:
        """Somebody else stands where a person stood: a track of theirs; the former is away."""
        self._counters.add("taken_over")
        away = self.of(Presence.AWAY)
        other = self._recognition.split(track, self._new_number(), stamp_ns)
        ((_, known, _),) = self._recognition.recognise([other], away)
        if known is not None:
            self._recognition.return_as(known, other, stamp_ns)
            return known
        self._counters.add("came")
        self.everybody.append(other)
        return other

    def confirm(self, stamp_ns: int) -> list[Assigned]:
        """Confirm whoever has been in view for long enough, as new or as back.

        Returns:
            Their skeletons until now, in the order in which they came.
        """
        ripe = [
            track
            for track in self.of(Presence.TENTATIVE)
            if track.frames >= CONFIRMED_FRAMES and track.in_view_s >= CONFIRMED_AFTER_S
        ]
        if not ripe:
            return []
        given: list[Assigned] = []
        people = self._without_doubles(ripe, stamp_ns)
        known_ones = self.of(Presence.PRESENT, Presence.AWAY)
        unseen = [track for track in known_ones if not track.is_certain(stamp_ns)]
        for track, known, margin in self._recognition.recognise(people, unseen):
            if not _is_decided(track, known, margin, is_anybody_away=bool(unseen)):
                continue
            if known is None:
                track.presence = Presence.PRESENT
                self._counters.add("came")
                given += [(track.number, sample) for sample in track.held]
            else:
                self._recognition.return_as(known, track, stamp_ns)
                given += [(known.number, sample) for sample in track.held]
                self.everybody.remove(track)
            track.held = []
        return given

    def join_doubles(self, stamp_ns: int) -> dict[int, int]:
        """Merge tracks of one person; by number of the removed one, the other's."""
        joined = {}
        for younger, older in self._doubles.found(self.present, stamp_ns):
            self._counters.add("joined")
            older.size.merge(younger.size)
            self.everybody.remove(younger)
            joined[younger.number] = older.number
        return joined

    def _without_doubles(self, ripe: list[PersonTrack], stamp_ns: int) -> list[PersonTrack]:
        """Those who stand inside of nobody; the others are removed."""
        people: list[PersonTrack] = []
        for track in ripe:
            if self._doubles.is_double(track, [*self.present, *people], stamp_ns):
                self._remove(track, "doubles")
            else:
                people.append(track)
        return people

    def _remove(self, track: PersonTrack, reason: str) -> None:
        self._counters.add(reason)
        self._counters.add("held_back", len(track.held))
        self.everybody.remove(track)

    def _new_number(self) -> int:
        self._next_number += 1
        return self._next_number - 1


def _is_decided(
    track: PersonTrack, known: PersonTrack | None, margin: float, *, is_anybody_away: bool
) -> bool:
    """Whether to accept the likeliest hypothesis of who a tentative person is.

    Args:
        track: The tentative person.
        known: Whom they are likeliest to be; ``None``: somebody new.
        margin: Log ratio against the next best hypothesis.
        is_anybody_away: Whether they could be somebody who is away.
    """
    is_certain = margin >= CERTAIN
    if known is not None:
        return is_certain or track.in_view_s >= RETURN_WITHIN_S
    if is_certain and not is_anybody_away and track.size.measurements >= NEW_MEASUREMENTS:
        return True
    return track.in_view_s >= (RETURN_WITHIN_S if is_certain else NEW_WITHIN_S)
