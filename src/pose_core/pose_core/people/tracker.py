"""Multi-person tracking: the skeletons of all sensors, frame by frame, assigned to persons.

A sensor's own ids are evidence, no more: trackers exchange them where people cross, and give new
ones to those who come back. What decides is where the joints are, all sensors' together in one
frame (:mod:`association`), and for those who were away, how large they are (:mod:`recognition`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from pose_core.counters import Counters
from pose_core.people.association import GATE_M, associate
from pose_core.people.distances import OTHER_SIDE, centres
from pose_core.people.doubles import Doubles
from pose_core.people.encounters import Encounters
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.people.recognition import Recognition
from pose_core.people.tracks import AWAY_AFTER_S, Assigned, Tracks
from pose_core.session.clocks import Clock, Clocks
from pose_core.streams.samples import FloatArray, SkeletonSample
from pose_core.transforms import transformed

UNCHECKED_FRAMES = 4  # [-] of one sensor, in which a lone person's id is believed
MOVED = 0.1  # [m], or [-] of a rotation's matrix, from which on a sensor has been moved
LEAST_JOINTS = 5  # [-] of somebody new
MOST_PEOPLE = 12  # [-] of one frame; cameras' trackers follow six


class PeopleTracker:
    """Assigns skeletons to persons, who keep their numbers through crossings and absences.

    Args:
        T_common_sensor: Each sensor's pose in one common frame, shape (4, 4), in practice in
            ``map``; frames of other sensors are left out.
        clocks: The sensors' clocks against the reference's.
    """

    def __init__(
        self, T_common_sensor: Mapping[str, FloatArray], clocks: Clocks | None = None
    ) -> None:
        self.T_common_sensor = dict(T_common_sensor)
        self.clocks: Clocks = clocks or {}
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
            "too_many",
        )
        self._recognition = Recognition(self.counters)
        self._encounters = Encounters(self._recognition)
        self._tracks = Tracks(self.counters, self._recognition, Doubles())

    @property
    def tracks(self) -> Sequence[PersonTrack]:
        """Everybody who is known."""
        return self._tracks.everybody

    @property
    def present(self) -> list[PersonTrack]:
        """Everybody in view, in the order in which they came."""
        return self._tracks.present

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest frame [ns], on the reference's clock."""
        return self._tracks.newest_ns

    def track(self, number: int) -> PersonTrack | None:
        """A known person; ``None`` if there is nobody of this number."""
        return next((track for track in self.tracks if track.number == number), None)

    def place_sensors(self, T_common_sensor: Mapping[str, FloatArray], clocks: Clocks) -> None:
        """Use these poses and clocks; if a sensor has been moved, everybody is found anew."""
        known = self.T_common_sensor
        is_moved = any(
            np.abs(known[name] - T).max() > MOVED
            for name, T in T_common_sensor.items()
            if name in known
        )
        self.T_common_sensor, self.clocks = dict(T_common_sensor), clocks
        if is_moved:
            for track in list(self.tracks):
                self._tracks.mark_absent(track)

    def add(self, frame: Sequence[SkeletonSample]) -> list[Assigned]:
        """Assign all skeletons that a sensor saw at one instant.

        Returns:
            The skeletons with their persons' numbers. Those of somebody new come when it is
            certain that there is somebody, together.
        """
        frame = [sample for sample in frame if any(sample.tracking_state.tolist())]
        if not frame:
            self.counters.add("nobody_seen")
            return []
        if frame[0].sensor not in self.T_common_sensor:
            return []
        self.counters.add("seen", len(frame))
        stamp_ns = self.stamp_ns(frame[0])
        self._tracks.age(stamp_ns)
        if len(frame) > MOST_PEOPLE:
            self.counters.add("too_many", len(frame) - MOST_PEOPLE)
            frame = self._nearest(frame, stamp_ns)
        alone = self._known_alone(frame, stamp_ns)
        if alone is not None:
            return [(alone.number, frame[0])]
        return self._assign(frame, stamp_ns)

    def stamp_ns(self, sample: SkeletonSample) -> int:
        """A sample's stamp on the reference's clock [ns]."""
        return self.clocks.get(sample.sensor, Clock()).to_reference(sample.stamp_ns)

    def _nearest(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> list[SkeletonSample]:
        """The skeletons of a crowd that are nearest to the people who are present."""
        T = self.T_common_sensor[frame[0].sensor]
        places = transformed(T, centres(np.stack([sample.positions for sample in frame])))
        distance = np.zeros(len(frame))
        if self.present:
            known = np.stack([track.expected_centre(stamp_ns) for track in self.present])
            distance = np.linalg.norm(places[:, None] - known[None], axis=2).min(axis=1)
        return [frame[k] for k in np.argsort(distance, kind="stable")[:MOST_PEOPLE]]

    def _known_alone(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> PersonTrack | None:
        """The only person in view, if the sensor has just had them under the same id."""
        near = self._tracks.in_view
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
        near[0].last_seen_ns = max(near[0].last_seen_ns, stamp_ns)
        return near[0]

    def _assign(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> list[Assigned]:
        T = self.T_common_sensor[frame[0].sensor]
        positions = np.stack([transformed(T, sample.positions) for sample in frame])
        near = self._tracks.in_view
        pairs, is_mirrored = associate(near, frame, positions, stamp_ns)
        given: list[Assigned] = []
        for row, column in pairs:
            joints = positions[column]
            joints = joints[OTHER_SIDE] if is_mirrored[row, column] else joints
            given += self._update(near[row], frame[column], joints, stamp_ns)
        taken = {column for _, column in pairs}
        for column, sample in enumerate(frame):
            if column not in taken:
                given += self._begin(sample, positions[column], stamp_ns, len(frame) == 1)
        given += self._tracks.confirm(stamp_ns)
        for one, other in self._encounters.exchanged(self.present, stamp_ns):
            self.counters.add("exchanged")
            one.exchange(other)
        joined = self._tracks.join_doubles(stamp_ns)
        return [(joined.get(number, number), sample) for number, sample in given]

    def _update(
        self, track: PersonTrack, sample: SkeletonSample, joints: FloatArray, stamp_ns: int
    ) -> list[Assigned]:
        """Add a skeleton to the track of a person in view."""
        view = track.views.get(sample.sensor)
        if view is not None and view.person != sample.person:
            self.counters.add("sensor_ids_changed")
        track.move(stamp_ns, joints)
        track.note(sample, stamp_ns)
        if track.presence is Presence.TENTATIVE:
            track.size.add(sample)
            track.held.append(sample)
            return []
        if self._recognition.measure(track, sample, self._tracks.of(Presence.AWAY), stamp_ns):
            track = self._tracks.take_over(track, stamp_ns)
        return [(track.number, sample)]

    def _begin(
        self, sample: SkeletonSample, joints: FloatArray, stamp_ns: int, is_alone: bool
    ) -> list[Assigned]:
        """Find out whose an unassigned skeleton is: somebody's who is back, or somebody new's."""
        near = self._tracks.in_view
        if np.isfinite(joints[:, 0]).sum() < LEAST_JOINTS and (self.tracks or not is_alone):
            return self._by_id(near, sample, joints, stamp_ns)
        if is_alone and not near and len(self.tracks) == 1:
            back = self.tracks[0]
            if self._recognition.is_within_reach(back, joints, stamp_ns):
                self._recognition.mark_returned(back, joints, stamp_ns)
                back.note(sample, stamp_ns)
                return [(back.number, sample)]
        return self._tracks.begin(sample, joints, stamp_ns, is_alone)

    def _by_id(
        self,
        near: Sequence[PersonTrack],
        sample: SkeletonSample,
        joints: FloatArray,
        stamp_ns: int,
    ) -> list[Assigned]:
        """Assign a skeleton of few joints by its id, if they are near; else it is a ghost."""
        for track in near:
            view = track.views.get(sample.sensor)
            is_same = view is not None and view.person == sample.person
            apart = np.linalg.norm(joints - track.expected(stamp_ns), axis=1)
            known = apart[np.isfinite(apart)]
            is_same &= not len(known) or bool(known.mean() <= GATE_M)
            if is_same and track.presence is Presence.PRESENT:
                track.note(sample, stamp_ns)
                return [(track.number, sample)]
        self.counters.add("ghosts")
        return []
