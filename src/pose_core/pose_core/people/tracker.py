"""Multi-person tracking: the skeletons of all sensors, frame by frame, assigned to persons.

A sensor's own ids are evidence, no more: trackers exchange them where people cross, and give new
ones to those who come back. What decides is where the joints are, all sensors' together in one
frame (:mod:`association`), and for those who were absent, how large they are
(:mod:`reidentification`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.counters import Counters
from pose_core.finite_numbers import nan_mean
from pose_core.joints import OTHER_SIDE
from pose_core.people.association import GATE_M, associate
from pose_core.people.encounters import TrackSwaps
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.people.track_manager import ABSENT_AFTER_S, Assigned, TrackManager
from pose_core.streams.clocks import Clocks, reference_stamp_ns
from pose_core.streams.samples import ImuBlock, SkeletonSample
from pose_core.transforms import transformed

BY_ID_S = 0.3  # [s] for which a lone person's id is believed without a look at the joints
MOVED = 0.1  # [m], or [-] of a rotation's matrix, from which on a sensor has been moved
MIN_JOINTS = 5  # [-] of somebody new
MAX_PEOPLE = 12  # [-] of one frame; cameras' trackers follow six


class PeopleTracker(TrackManager):
    """Assigns skeletons to persons, who keep their numbers through crossings and absences.

    What becomes of the persons' tracks is up to the base class.

    Args:
        T_common_sensor: Each sensor's pose in one common frame, shape (4, 4), in practice in
            ``map``; frames of other sensors are left out.
        clocks: The sensors' clocks against the reference's.
        rough_m: Distance [m] of a joint in two views of trackers that guess distances.
    """

    def __init__(
        self,
        T_common_sensor: Mapping[str, FloatArray],
        clocks: Clocks | None = None,
        rough_m: float = 0.0,
    ) -> None:
        self.T_common_sensor = dict(T_common_sensor)
        self.clocks: Clocks = clocks or {}
        counters = Counters(
            "seen",
            "nobody_seen",
            "appeared",
            "left",
            "returned",
            "split",
            "ghosts",
            "duplicates",
            "merged",
            "track_swaps",
            "sensor_ids_changed",
            "held_back",
            "too_many",
        )
        super().__init__(counters)
        self._swaps = TrackSwaps()
        self._rough_m = rough_m

    @property
    def holds_back(self) -> bool:
        """Whether somebody in view is not confirmed yet."""
        return any(track.held for track in self.tracks)

    def track(self, number: int) -> PersonTrack | None:
        """A known person; ``None`` if there is nobody of this number."""
        return next((track for track in self.tracks if track.number == number), None)

    def place_sensors(
        self, T_common_sensor: Mapping[str, FloatArray], clocks: Clocks, rough_m: float
    ) -> None:
        """Use these poses and clocks; if a sensor has been moved, all tracks restart.

        Args:
            T_common_sensor: (4, 4) by sensor.
            clocks: Clocks that correct the stamps.
            rough_m: See the class.
        """
        known = self.T_common_sensor
        is_moved = any(
            np.abs(known[name] - T).max() > MOVED
            for name, T in T_common_sensor.items()
            if name in known
        )
        self.T_common_sensor, self.clocks = dict(T_common_sensor), clocks
        self._rough_m = rough_m
        if is_moved:
            for track in list(self.tracks):
                self.mark_absent(track)

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
        self.advance(stamp_ns)
        if len(frame) > MAX_PEOPLE:
            self.counters.add("too_many", len(frame) - MAX_PEOPLE)
            frame = self._nearest(frame, stamp_ns)
        alone = self._lone_person(frame, stamp_ns)
        if alone is not None:
            return [(alone.number, frame[0])]
        return self._assign(frame, stamp_ns)

    def add_imus(self, block: ImuBlock) -> None:
        """Add samples of worn IMUs, which tell who comes back."""
        self._wearer.add_imus(block)

    def stamp_ns(self, sample: SkeletonSample) -> int:
        """A sample's stamp on the reference's clock [ns]."""
        return reference_stamp_ns(sample, self.clocks)

    def _nearest(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> list[SkeletonSample]:
        """The skeletons of a crowd that are nearest to the people who are present."""
        T = self.T_common_sensor[frame[0].sensor]
        places = transformed(T, nan_mean(np.stack([sample.positions for sample in frame]), axis=1))
        distance = np.zeros(len(frame))
        if self.present:
            known = np.stack([track.predicted_centre(stamp_ns) for track in self.present])
            distance = np.linalg.norm(places[:, None] - known[None], axis=2).min(axis=1)
        return [frame[k] for k in np.argsort(distance, kind="stable")[:MAX_PEOPLE]]

    def _lone_person(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> PersonTrack | None:
        """The only person in view, if the sensor has just had them under the same id."""
        in_view = self.in_view
        if len(frame) > 1 or len(in_view) != 1 or in_view[0].presence is not Presence.PRESENT:
            return None
        view = in_view[0].views.get(frame[0].sensor)
        if (
            view is None
            or not self._reidentification.has_known_size(in_view[0])
            or view.person != frame[0].person
            or stamp_ns - view.stamp_ns > ABSENT_AFTER_S * 1e9
            or stamp_ns - view.assigned_ns > BY_ID_S * 1e9
        ):
            return None
        view.stamp_ns = stamp_ns
        in_view[0].last_seen_ns = max(in_view[0].last_seen_ns, stamp_ns)
        return in_view[0]

    def _assign(self, frame: Sequence[SkeletonSample], stamp_ns: int) -> list[Assigned]:
        T = self.T_common_sensor[frame[0].sensor]
        positions = np.stack([transformed(T, sample.positions) for sample in frame])
        in_view = self.in_view
        pairs, is_mirrored = associate(in_view, frame, positions, stamp_ns, self._rough_m)
        assigned: list[Assigned] = []
        for row, column in pairs:
            joints = positions[column]
            joints = joints[OTHER_SIDE] if is_mirrored[row, column] else joints
            assigned += self._update(in_view[row], frame[column], joints, stamp_ns)
        taken = {column for _, column in pairs}
        for column, sample in enumerate(frame):
            if column not in taken:
                joints = positions[column]
                assigned += self._assign_unmatched(sample, joints, stamp_ns, len(frame) == 1)
        assigned += self.confirm(stamp_ns)
        for one, other in self._swaps.find(self.present, stamp_ns):
            self.counters.add("track_swaps")
            one.swap_identity(other)
        merged = self.merge_duplicates(stamp_ns)
        return [(merged.get(number, number), sample) for number, sample in assigned]

    def _update(
        self, track: PersonTrack, sample: SkeletonSample, joints: FloatArray, stamp_ns: int
    ) -> list[Assigned]:
        """Add a skeleton to the track of a person in view."""
        if sample.sensor in track.views and not track.is_called(sample.person, sample.sensor):
            self.counters.add("sensor_ids_changed")
        track.update(stamp_ns, joints)
        track.note_detection(sample, stamp_ns)
        self._wearer.add(track.number, stamp_ns, joints)
        if track.presence is Presence.TENTATIVE:
            track.size.add(sample)
            track.held.append(sample)
            return []
        absent = self.of(Presence.ABSENT)
        if self._reidentification.update_size(track, sample, absent, stamp_ns):
            track = self.split_off(track, stamp_ns)
        return [(track.number, sample)]

    def _assign_unmatched(
        self, sample: SkeletonSample, joints: FloatArray, stamp_ns: int, is_alone: bool
    ) -> list[Assigned]:
        """Find out whose an unassigned skeleton is: somebody's who is back, or somebody new's."""
        in_view = self.in_view
        if np.isfinite(joints[:, 0]).sum() < MIN_JOINTS and (self.tracks or not is_alone):
            return self._assign_by_id(in_view, sample, joints, stamp_ns)
        if is_alone and not in_view and len(self.tracks) == 1:
            returned = self.tracks[0]
            if self._reidentification.is_within_reach(returned, joints, stamp_ns):
                self._reidentification.mark_returned(returned, joints, stamp_ns)
                returned.note_detection(sample, stamp_ns)
                return [(returned.number, sample)]
        return self.initiate(sample, joints, stamp_ns, is_alone)

    def _assign_by_id(
        self,
        in_view: Sequence[PersonTrack],
        sample: SkeletonSample,
        joints: FloatArray,
        stamp_ns: int,
    ) -> list[Assigned]:
        """Assign a skeleton of few joints by its id, if they are near; else it is a ghost."""
        for track in in_view:
            apart = np.linalg.norm(joints - track.predicted(stamp_ns), axis=1)
            known = apart[np.isfinite(apart)]
            is_near = not len(known) or bool(known.mean() <= GATE_M)
            is_same = is_near and track.is_called(sample.person, sample.sensor)
            if is_same and track.presence is Presence.PRESENT:
                track.note_detection(sample, stamp_ns)
                return [(track.number, sample)]
        self.counters.add("ghosts")
        return []
