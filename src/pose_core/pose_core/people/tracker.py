r"""Who is who: the skeletons of all sensors, frame by frame, assigned to persons.

A sensor's own ids are evidence, no more: trackers exchange them where people cross, and give new
ones to those who come back. What decides is where the joints are, all sensors' together in one
frame, and for those who were away, how large they are (:mod:`recognition`).

Each frame is assigned as a whole (global nearest neighbour; Bar-Shalom, Willett, Tian: *Tracking
and Data Fusion*, 2011, ch. 6): the assignment of skeletons to persons that minimises

.. math:: \sum_i d(\hat p_i, s_i) + e(i, s_i)

with the mean distance :math:`d` of the joints from where they are expected, and :math:`e` for an
id that speaks against it.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.counters import Counters
from pose_core.people.assignment import assign
from pose_core.people.distances import OTHER_SIDE, joint_distances
from pose_core.people.doubles import Doubles
from pose_core.people.encounters import Encounters
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.people.recognition import REMEMBERED, Recognition
from pose_core.session.clocks import Clocks
from pose_core.streams.samples import FloatArray, SkeletonSample
from pose_core.transforms import transformed

AWAY_AFTER_S = 0.7  # [s] unseen by all sensors, a person is away
GATE_M = 0.55  # [m] mean distance of the joints from where they are expected
GATE_SPEED = 1.5  # [m/s] by which the gate widens while nobody looks where a person is
WIDEST_GATE_M = 0.95  # [m]
SAME_ID_M = 0.1  # [m] by which an id speaks for the person who had it, and against others
ID_HOLDS_S = 2.0  # [s] for which a sensor's id says something
TENTATIVE_M = 0.1  # [m] by which a known person goes before one who was seen for a moment
CONFIRMED_AFTER_S = 0.3  # [s] in sight: shorter ones are trackers' ghosts
COMPARED_AFTER_S = 0.5  # [s] the same, where somebody is away whom they may be
CONFIRMED_FRAMES = 5  # [-] the same in frames
GHOST_AFTER_S = 0.3  # [s] unseen: nobody was there
UNCHECKED_FRAMES = 4  # [-] of one sensor, that a lone person's id is believed for
MOVED = 0.1  # [m], or [-] of a rotation's matrix, by which a sensor stands elsewhere
JUMP_BACK_S = 1.0  # [s] further back than this, a recording has begun anew
LEAST_JOINTS = 5  # [-] of somebody new

Assigned = tuple[int, SkeletonSample]
"""A person's number and a skeleton of theirs."""


class PeopleTracker:
    """Assigns skeletons to persons, who keep their numbers through crossings and absences.

    Args:
        T_common_sensor: Each sensor's place in one common frame, (4, 4), in practice in ``map``;
            frames of other sensors are left out.
        clocks: How the sensors' clocks stand to the reference's.
    """

    def __init__(
        self, T_common_sensor: Mapping[str, FloatArray], clocks: Clocks | None = None
    ) -> None:
        self.T_common_sensor = dict(T_common_sensor)
        self.clocks: Clocks = clocks or {}
        self.tracks: list[PersonTrack] = []
        self.counters = Counters(
            "seen",
            "nobody_seen",
            "came",
            "went_away",
            "came_back",
            "taken_over",
            "ghosts",
            "doubles",
            "joined",
            "exchanged",
            "sensor_ids_changed",
            "held_back",
        )
        self._recognition = Recognition(self.counters)
        self._doubles = Doubles()
        self._encounters = Encounters(self._recognition)
        self._next_number = 1
        self._newest_ns: int | None = None

    @property
    def present(self) -> list[PersonTrack]:
        """Everybody who is in sight, in the order in which they came."""
        return [track for track in self.tracks if track.presence is Presence.PRESENT]

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest frame [ns], on the reference's clock."""
        return self._newest_ns or 0

    def track(self, number: int) -> PersonTrack | None:
        """A known person; None if they were nobody."""
        return next((track for track in self.tracks if track.number == number), None)

    def place_sensors(self, T_common_sensor: Mapping[str, FloatArray], clocks: Clocks) -> None:
        """Sensors stand so from now on; where they stood elsewhere, everybody is found anew."""
        known = self.T_common_sensor
        moved = any(
            np.abs(known[name] - T).max() > MOVED
            for name, T in T_common_sensor.items()
            if name in known
        )
        self.T_common_sensor, self.clocks = dict(T_common_sensor), clocks
        if moved:
            for track in self.tracks:
                self._send_away(track)

    def add(self, frame: Sequence[SkeletonSample]) -> list[Assigned]:
        """Take all that a sensor saw at one instant.

        Returns:
            The skeletons with their persons' numbers. Those of somebody new come when it is
            certain that there is somebody, together.
        """
        if not frame:
            self.counters.add("nobody_seen")
            return []
        if frame[0].sensor not in self.T_common_sensor:
            return []
        self.counters.add("seen", len(frame))
        stamp_ns = self.stamp_ns(frame[0])
        self._age(stamp_ns)
        alone = self._alone(frame, stamp_ns)
        if alone is not None:
            return [(alone.number, frame[0])]
        return self._assigned(frame, stamp_ns)

    def stamp_ns(self, sample: SkeletonSample) -> int:
        """A sample's stamp on the reference's clock [ns]."""
        clock = self.clocks.get(sample.sensor)
        return sample.stamp_ns if clock is None else clock.to_reference(sample.stamp_ns)

    def _age(self, stamp_ns: int) -> None:
        """Whom nobody has seen for a while is away, or was nobody."""
        newest_ns = stamp_ns if self._newest_ns is None else self._newest_ns
        if stamp_ns < newest_ns - JUMP_BACK_S * 1e9:
            for track in self.tracks:
                self._send_away(track)
                track.seen_ns = stamp_ns
            newest_ns = stamp_ns
        self._newest_ns = max(newest_ns, stamp_ns)
        for track in list(self.tracks):
            unseen_s = track.unseen_s(stamp_ns)
            if track.presence is Presence.PRESENT and unseen_s > AWAY_AFTER_S:
                self._send_away(track)
            elif track.presence is Presence.TENTATIVE and unseen_s > GHOST_AFTER_S:
                self.counters.add("ghosts")
                self.counters.add("held_back", len(track.held))
                self.tracks.remove(track)

    def _send_away(self, track: PersonTrack) -> None:
        if track.presence is Presence.PRESENT:
            track.presence = Presence.AWAY
            self._recognition.settle(track)
            self.counters.add("went_away")
            away = [each for each in self.tracks if each.presence is Presence.AWAY]
            if len(away) > REMEMBERED:
                self.tracks.remove(min(away, key=lambda each: each.seen_ns))

    def _alone(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> PersonTrack | None:
        """The only person in sight, if the sensor has just had them under the same id."""
        near = [track for track in self.tracks if track.presence is not Presence.AWAY]
        if len(frame) > 1 or len(near) != 1 or near[0].presence is not Presence.PRESENT:
            return None
        view = near[0].views.get(frame[0].sensor)
        if (
            view is None
            or not self._recognition.is_settled(near[0])
            or view.person != frame[0].person
            or stamp_ns - view.stamp_ns > AWAY_AFTER_S * 1e9
            or view.unchecked >= UNCHECKED_FRAMES
        ):
            return None
        view.unchecked += 1
        view.stamp_ns = stamp_ns
        near[0].seen_ns = max(near[0].seen_ns, stamp_ns)
        return near[0]

    def _assigned(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> list[Assigned]:
        T = self.T_common_sensor[frame[0].sensor]
        seen = np.stack([transformed(T, sample.positions) for sample in frame])
        near = [track for track in self.tracks if track.presence is not Presence.AWAY]
        pairs, mirrored = self._pairs(near, frame, seen, stamp_ns)
        given: list[Assigned] = []
        for row, column in pairs:
            joints = seen[column][OTHER_SIDE] if mirrored[row, column] else seen[column]
            given += self._take(near[row], frame[column], joints, stamp_ns)
        taken = {column for _, column in pairs}
        for column, sample in enumerate(frame):
            if column not in taken:
                given += self._begin(sample, seen[column], stamp_ns, len(frame) == 1)
        given += self._confirm(stamp_ns)
        for one, other in self._encounters.exchanged(self.present, stamp_ns):
            self.counters.add("exchanged")
            one.exchange(other)
        for younger, older in self._doubles.found(self.present, stamp_ns):
            self.counters.add("joined")
            older.size.merge(younger.size)
            self.tracks.remove(younger)
            given = [(older.number if n == younger.number else n, one) for n, one in given]
        return given

    def _pairs(
        self,
        near: Sequence[PersonTrack],
        frame: Sequence[SkeletonSample],
        seen: FloatArray,
        stamp_ns: int,
    ) -> tuple[list[tuple[int, int]], NDArray[np.bool_]]:
        """Which of the persons each skeleton is of, as indices; and whether sides are exchanged."""
        if not near:
            return [], np.empty((0, len(frame)), np.bool_)
        expected = np.stack([track.expected(stamp_ns) for track in near])
        distance, mirrored = joint_distances(expected, seen)
        cost = distance.copy()
        for row, track in enumerate(near):
            gate = min(GATE_M + GATE_SPEED * track.unplaced_s(stamp_ns), WIDEST_GATE_M)
            cost[row, distance[row] > gate] = np.inf
            cost[row] += TENTATIVE_M * (track.presence is Presence.TENTATIVE)
        return assign(cost + self._id_costs(near, frame, stamp_ns)), mirrored

    def _id_costs(
        self, near: Sequence[PersonTrack], frame: Sequence[SkeletonSample], stamp_ns: int
    ) -> FloatArray:
        """What the sensor's own ids say, (persons, skeletons) [m]."""
        costs = np.zeros((len(near), len(frame)))
        for row, track in enumerate(near):
            view = track.views.get(frame[0].sensor)
            if view is None or stamp_ns - view.stamp_ns > ID_HOLDS_S * 1e9:
                continue
            for column, sample in enumerate(frame):
                costs[row, column] = 0.0 if sample.person == view.person else SAME_ID_M
        return costs

    def _take(
        self, track: PersonTrack, sample: SkeletonSample, joints: FloatArray, stamp_ns: int
    ) -> list[Assigned]:
        """A skeleton of a person who is in sight."""
        view = track.views.get(sample.sensor)
        if view is not None and view.person != sample.person:
            self.counters.add("sensor_ids_changed")
        track.move(stamp_ns, joints)
        track.note(sample, stamp_ns)
        if track.presence is Presence.TENTATIVE:
            track.size.add(sample)
            track.held.append(sample)
            return []
        if self._recognition.measure(track, sample, stamp_ns):
            track = self._replace(track, stamp_ns)
        return [(track.number, sample)]

    def _replace(self, track: PersonTrack, stamp_ns: int) -> PersonTrack:
        """Somebody else stands where a person stood: a new person, and the former one is away."""
        self.counters.add("taken_over")
        away = [each for each in self.tracks if each.presence is Presence.AWAY]
        other = self._recognition.split(track, self._next_number, stamp_ns)
        self._next_number += 1
        ((_, known),) = self._recognition.recognise([other], away, stamp_ns)
        if known is not None:
            self._recognition.return_as(known, other, stamp_ns)
            return known
        self.counters.add("came")
        self.tracks.append(other)
        return other

    def _begin(
        self, sample: SkeletonSample, joints: FloatArray, stamp_ns: int, alone: bool
    ) -> list[Assigned]:
        """A skeleton of nobody who is in sight."""
        near = [track for track in self.tracks if track.presence is not Presence.AWAY]
        if np.isfinite(joints[:, 0]).sum() < LEAST_JOINTS and (self.tracks or not alone):
            return self._by_id(near, sample, stamp_ns)
        if alone and not near and len(self.tracks) == 1:
            back = self.tracks[0]
            if self._recognition.is_within_reach(back, joints, stamp_ns):
                self._recognition.welcome(back, joints, stamp_ns)
                back.note(sample, stamp_ns)
                return [(back.number, sample)]
        track = PersonTrack(
            number=self._next_number,
            presence=Presence.TENTATIVE,
            born_ns=stamp_ns,
            seen_ns=stamp_ns,
            positions=np.full_like(joints, np.nan),
        )
        self._next_number += 1
        track.move(stamp_ns, joints, anew=True)
        track.note(sample, stamp_ns)
        track.size.add(sample)
        self.tracks.append(track)
        if alone and len(self.tracks) == 1:
            track.presence = Presence.PRESENT
            self.counters.add("came")
            return [(track.number, sample)]
        track.held.append(sample)
        return []

    def _by_id(
        self, near: Sequence[PersonTrack], sample: SkeletonSample, stamp_ns: int
    ) -> list[Assigned]:
        """A skeleton of so few joints that its id alone says who it is."""
        for track in near:
            view = track.views.get(sample.sensor)
            is_same = view is not None and view.person == sample.person
            if is_same and track.presence is Presence.PRESENT:
                track.note(sample, stamp_ns)
                return [(track.number, sample)]
        self.counters.add("ghosts")
        return []

    def _without_doubles(self, ripe: Sequence[PersonTrack], stamp_ns: int) -> list[PersonTrack]:
        """Those who stand inside of nobody; the others are forgotten."""
        people: list[PersonTrack] = []
        for track in ripe:
            if self._doubles.is_double(track, [*self.present, *people], stamp_ns):
                self.counters.add("doubles")
                self.counters.add("held_back", len(track.held))
                self.tracks.remove(track)
            else:
                people.append(track)
        return people

    def _confirm(self, stamp_ns: int) -> list[Assigned]:
        """Whoever has been in sight for long enough is somebody: new, or back."""
        away = [track for track in self.tracks if track.presence is Presence.AWAY]
        after_s = COMPARED_AFTER_S if away else CONFIRMED_AFTER_S
        ripe = [
            track
            for track in self.tracks
            if track.presence is Presence.TENTATIVE
            and track.frames >= CONFIRMED_FRAMES
            and track.seen_ns - track.born_ns >= after_s * 1e9
        ]
        if not ripe:
            return []
        ripe = self._without_doubles(ripe, stamp_ns)
        given: list[Assigned] = []
        for track, known in self._recognition.recognise(ripe, away, stamp_ns):
            if known is None:
                track.presence = Presence.PRESENT
                self.counters.add("came")
                given += [(track.number, sample) for sample in track.held]
            else:
                self._recognition.return_as(known, track, stamp_ns)
                self.counters.add("held_back", len(track.held) - 1)
                given.append((known.number, track.held[-1]))
                self.tracks.remove(track)
            track.held = []
        return given
