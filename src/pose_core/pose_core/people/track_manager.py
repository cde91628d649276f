"""Track management: begins, confirms and ends the tracks of persons.

Somebody new is tentative first: trackers show ghosts for moments. Who is not seen for a while is
absent, and is compared with everybody who comes later (:mod:`reidentification`).
"""

from collections.abc import Collection

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.counters import Counters
from pose_core.finite_numbers import nan_mean
from pose_core.people.encounters import DUPLICATE_M, DuplicateTracks, distance
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.people.reidentification import CERTAIN, MAX_ABSENT, Reidentification
from pose_core.people.wearer import WearerSearch
from pose_core.stamps import JUMP_BACK_NS
from pose_core.streams.samples import SkeletonSample

ABSENT_AFTER_S = 0.35  # [s] unseen by all sensors, a person is absent
CONFIRMED_AFTER_S = 0.3  # [s] in view: shorter ones are trackers' ghosts
RETURN_DECIDED_AFTER_S = 4.0  # [s] in view, after which the likelier hypothesis is accepted
NEW_DECIDED_AFTER_S = 8.0  # [s] the same for somebody new, while anybody is absent
NEW_MEASUREMENTS = 60  # [-] skeletons of somebody new: a glimpse does not give a size
CONFIRMED_FRAMES = 5  # [-] the same in frames
GHOST_AFTER_S = 0.8  # [s] unseen, a tentative person was a ghost
MAX_TENTATIVE = 12  # [-] at a time; of ghosts all over the place, the others are left out

Assigned = tuple[int, SkeletonSample]
"""A person's number and a skeleton of theirs."""


class TrackManager:
    """Everybody's tracks: initiates, confirms, merges and removes them.

    Args:
        counters: Declares all reasons, see :class:`pose_core.people.tracker.PeopleTracker`.

    Attributes:
        counters: The same.
        tracks: All tracks, in the order in which they began.
        newest_ns: Stamp of the newest frame [ns], on the reference's clock.
    """

    def __init__(self, counters: Counters) -> None:
        self.tracks: list[PersonTrack] = []
        self.newest_ns = 0
        self.counters = counters
        self._wearer = WearerSearch()
        self._reidentification = Reidentification(counters, self._wearer)
        self._duplicates = DuplicateTracks()
        self._next_number = 1

    def of(self, *presences: Presence) -> list[PersonTrack]:
        """The tracks of these presences."""
        return [track for track in self.tracks if track.presence in presences]

    @property
    def present(self) -> list[PersonTrack]:
        """Everybody in view, in the order in which they came."""
        return self.of(Presence.PRESENT)

    @property
    def differing(self) -> Collection[int]:
        """Numbers of those who came back with another size than before: somebody else?"""
        return self._reidentification.differing

    @property
    def in_view(self) -> list[PersonTrack]:
        """Everybody in view, tentative ones too."""
        return self.of(Presence.PRESENT, Presence.TENTATIVE)

    def advance(self, stamp_ns: int) -> None:
        """Advance to a frame's instant [ns]: end the tracks that have not been seen for long."""
        if stamp_ns < self.newest_ns - JUMP_BACK_NS:
            for track in list(self.tracks):
                self.mark_absent(track)
                track.last_seen_ns = stamp_ns
            self.newest_ns = stamp_ns
        self.newest_ns = max(self.newest_ns, stamp_ns)
        for track in list(self.tracks):
            unseen_s = track.unseen_s(stamp_ns)
            if track.presence is Presence.PRESENT and unseen_s > ABSENT_AFTER_S:
                self.mark_absent(track)
            elif track.presence is Presence.TENTATIVE and unseen_s > GHOST_AFTER_S:
                self._remove(track, "ghosts")

    def mark_absent(self, track: PersonTrack) -> None:
        """Mark somebody in view as absent; who left longest ago may be forgotten."""
        if track.presence is Presence.PRESENT:
            track.presence = Presence.ABSENT
            self._reidentification.drop_recent_size(track)
            self.counters.add("left")
            absent = self.of(Presence.ABSENT)
            if len(absent) > MAX_ABSENT:
                self.tracks.remove(min(absent, key=lambda each: each.last_seen_ns))

    def initiate(
        self, sample: SkeletonSample, joints: FloatArray, stamp_ns: int, is_alone: bool
    ) -> list[Assigned]:
        """Initiate the track of somebody new.

        Args:
            sample: Their first skeleton.
            joints: Its joints in the common frame [m], shape (15, 3).
            stamp_ns: Its stamp on the reference's clock [ns].
            is_alone: Whether it is the only skeleton of its frame.

        Returns:
            The skeleton, if nobody else is known; otherwise it is held until they are confirmed.
        """
        if len(self.of(Presence.TENTATIVE)) >= MAX_TENTATIVE:
            self.counters.add("too_many")
            return []
        track = PersonTrack(
            number=self._new_number(),
            presence=Presence.TENTATIVE,
            initiated_ns=stamp_ns,
            last_seen_ns=stamp_ns,
            initiated_at=nan_mean(joints),
            positions=np.full_like(joints, np.nan),
        )
        track.update(stamp_ns, joints, restarts=True)
        track.note_detection(sample, stamp_ns)
        track.size.add(sample)
        self.tracks.append(track)
        if is_alone and len(self.tracks) == 1:
            track.presence = Presence.PRESENT
            self.counters.add("appeared")
            return [(track.number, sample)]
        track.held.append(sample)
        return []

    def split_off(self, track: PersonTrack, stamp_ns: int) -> PersonTrack:
        """Begin a track of somebody who stands where a person stood; the former is absent."""
        self.counters.add("split")
        absent = self.of(Presence.ABSENT)
        other = self._reidentification.split_off(track, self._new_number(), stamp_ns)
        ((_, known, _),) = self._reidentification.match([other], absent)
        if known is not None:
            self._reidentification.resume(known, other, stamp_ns)
            return known
        self.counters.add("appeared")
        self.tracks.append(other)
        return other

    def confirm(self, stamp_ns: int) -> list[Assigned]:
        """Confirm whoever has been in view for long enough, as new or as back.

        Returns:
            Their skeletons until now, in the order in which they came.
        """
        candidates = [
            track
            for track in self.of(Presence.TENTATIVE)
            if track.frames >= CONFIRMED_FRAMES and track.in_view_s >= CONFIRMED_AFTER_S
        ]
        if not candidates:
            return []
        assigned: list[Assigned] = []
        people = self._without_duplicates(candidates, stamp_ns)
        known_people = self.of(Presence.PRESENT, Presence.ABSENT)
        unseen = [track for track in known_people if not track.is_observed(stamp_ns)]
        for track, known, margin in self._reidentification.match(people, unseen):
            if not _is_decided(track, known, margin, is_anybody_absent=bool(unseen)):
                continue
            if known is None:
                track.presence = Presence.PRESENT
                self.counters.add("appeared")
            else:
                self._reidentification.resume(known, track, stamp_ns)
                self.tracks.remove(track)
            assigned += [((known or track).number, sample) for sample in track.held]
            track.held = []
        return assigned

    def merge_duplicates(self, stamp_ns: int) -> dict[int, int]:
        """Merge tracks of one person; by number of the removed one, the other's."""
        survivors = {}
        for younger, older in self._duplicates.find(self.present, stamp_ns):
            self.counters.add("merged")
            older.size.merge(younger.size)
            self.tracks.remove(younger)
            survivors[younger.number] = older.number
        return survivors

    def _without_duplicates(
        self, candidates: list[PersonTrack], stamp_ns: int
    ) -> list[PersonTrack]:
        """Those who stand inside of nobody; the others are removed."""
        people: list[PersonTrack] = []
        for track in candidates:
            others = [*self.present, *people]
            if any(distance(other, track, stamp_ns) < DUPLICATE_M for other in others):
                self._remove(track, "duplicates")
            else:
                people.append(track)
        return people

    def _remove(self, track: PersonTrack, reason: str) -> None:
        self.counters.add(reason)
        self.counters.add("held_back", len(track.held))
        self.tracks.remove(track)

    def _new_number(self) -> int:
        self._next_number += 1
        return self._next_number - 1


def _is_decided(
    track: PersonTrack, known: PersonTrack | None, margin: float, *, is_anybody_absent: bool
) -> bool:
    """Whether to accept the likeliest hypothesis of who a tentative person is.

    Args:
        track: The tentative person.
        known: Whom they are likeliest to be; ``None``: somebody new.
        margin: Log ratio against the next best hypothesis.
        is_anybody_absent: Whether they could be somebody who is absent.
    """
    is_certain = margin >= CERTAIN
    if known is not None:
        return is_certain or track.in_view_s >= RETURN_DECIDED_AFTER_S
    if is_certain and not is_anybody_absent and track.size.measurements >= NEW_MEASUREMENTS:
        return True
    return track.in_view_s >= (RETURN_DECIDED_AFTER_S if is_certain else NEW_DECIDED_AFTER_S)
