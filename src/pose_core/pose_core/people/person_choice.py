"""Choice of one person among several."""

from collections.abc import Sequence

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.counters import Counters
from pose_core.finite_numbers import nan_mean
from pose_core.people.person_track import PersonTrack
from pose_core.people.tracker import PeopleTracker
from pose_core.people.wearer import WearerSearch
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.samples import ImuBlock, SkeletonSample

FIRST, NEAREST, IMUS = "first", "nearest", "imus"
KEPT_S = 6.0  # [s] out of sight, a person stays the chosen one
NEARER_M = 0.5  # [m] by which somebody must be nearer to be chosen instead
NEARER_FOR_S = 1.0  # [s] for which


class PersonChoice:
    """Chooses one person by a rule, and stays with them while they are known.

    - ``first`` (or empty): who came first of those who are there;
    - ``nearest``: who stands nearest to the first sensor, by half a metre for a second;
    - ``imus``: who wears the IMUs;
    - anything else: whom a sensor gives this id.

    Somebody who leaves stays chosen for six seconds; then the rule chooses again.

    Args:
        rule: The rule.
        wearer: Compares people with the IMUs, for the rule ``imus``.

    Attributes:
        number: Of the chosen person; None while there is none.
    """

    def __init__(self, rule: str, wearer: WearerSearch | None = None) -> None:
        self.rule = rule or FIRST
        self._wearer = wearer or WearerSearch()
        self.number: int | None = None
        self._nearer: tuple[int, int] | None = None  # who, and since when [ns]

    def choose_by(self, rule: str) -> None:
        """Choose by another rule from now on."""
        self.rule, self.number, self._nearer = rule or FIRST, None, None

    def add_imus(self, block: ImuBlock) -> None:
        """Add IMU samples, for the rule ``imus``."""
        if self.rule == IMUS:
            self._wearer.add_imus(block)

    def update(self, people: PeopleTracker) -> None:
        """Choose among the people who are known, after a frame of theirs."""
        stamp_ns = people.newest_ns
        if self.rule == IMUS:
            self._find_wearer(people.present, stamp_ns)
        chosen = None if self.number is None else people.track(self.number)
        if chosen is not None and chosen.unseen_s(stamp_ns) > KEPT_S:
            chosen = None
        place = next(iter(people.T_common_sensor.values()))[:3, 3]  # of the first sensor
        if chosen is None:
            chosen = self._best(people.present, place)
        elif self.rule == NEAREST:
            chosen = self._still_nearest(chosen, people.present, stamp_ns, place)
        self.number = None if chosen is None else chosen.number

    def _find_wearer(self, present: Sequence[PersonTrack], stamp_ns: int) -> None:
        for track in present:
            if track.last_seen_ns == stamp_ns:
                self._wearer.add(track.number, stamp_ns, track.positions)
        wearer = self._wearer.wearer()
        if wearer is not None:
            self.number = wearer

    def _best(self, present: Sequence[PersonTrack], place: FloatArray) -> PersonTrack | None:
        if not present or self.rule == IMUS:
            return None
        if self.rule == FIRST:
            return min(present, key=lambda track: (track.initiated_ns, track.number))
        if self.rule == NEAREST:
            return min(present, key=lambda track: _distance(track, place))
        named = [t for t in present if any(t.is_called(self.rule, sensor) for sensor in t.views)]
        return named[0] if named else None

    def _still_nearest(
        self, chosen: PersonTrack, present: Sequence[PersonTrack], stamp_ns: int, place: FloatArray
    ) -> PersonTrack:
        nearest = self._best(present, place) or chosen
        if _distance(nearest, place) > _distance(chosen, place) - NEARER_M:
            self._nearer = None
            return chosen
        if self._nearer is None or self._nearer[0] != nearest.number:
            self._nearer = nearest.number, stamp_ns
        return nearest if stamp_ns - self._nearer[1] > NEARER_FOR_S * 1e9 else chosen


def _distance(track: PersonTrack, place: FloatArray) -> float:
    return float(np.linalg.norm(nan_mean(track.positions) - place))


_People = tuple[PeopleTracker, PersonChoice]


class ChosenPerson:
    """Selects one person's skeletons, as :class:`PeoplePipeline` selects its subject's.

    Without extrinsics the rule is applied in each sensor by itself, and a rule that is a sensor's
    id selects by the id alone.

    Args:
        rule: See :class:`PersonChoice`.
        extrinsics: The sensors' poses, if they are known.
    """

    def __init__(self, rule: str = "", extrinsics: Extrinsics | None = None) -> None:
        self.counters = Counters("nobody_seen", "chosen", "other_person")
        self._rule = rule
        self._wearer = WearerSearch()
        self._everywhere: _People | None = None
        self._by_sensor: dict[str, _People] = {}
        if extrinsics is not None:
            self.use_extrinsics(extrinsics)

    def use_extrinsics(self, extrinsics: Extrinsics) -> None:
        """Assign the skeletons of all sensors together from now on."""
        places = {name: extrinsics.T_map_sensor(name) for name in extrinsics.sensors}
        self._everywhere = self._make(PeopleTracker(places, extrinsics.clocks, extrinsics.rough_m))

    def add_imus(self, block: ImuBlock) -> None:
        """Add IMU samples, for the rule ``imus``."""
        if self._rule == IMUS:
            self._wearer.add_imus(block)

    def select(self, frame: Sequence[SkeletonSample]) -> list[SkeletonSample]:
        """The person's skeletons of a sensor's frame: one, none, or those held back until now."""
        if not frame:
            self.counters.add("nobody_seen")
            return []
        if self._everywhere is None and self._rule not in ("", FIRST, NEAREST, IMUS):
            chosen = [sample for sample in frame if sample.person == self._rule][:1]
        else:
            sensor, everywhere = frame[0].sensor, self._everywhere
            if everywhere is not None and sensor in everywhere[0].T_common_sensor:
                people, choice = everywhere
            else:
                if sensor not in self._by_sensor:
                    self._by_sensor[sensor] = self._make(PeopleTracker({sensor: np.eye(4)}))
                people, choice = self._by_sensor[sensor]
            assigned = people.add(frame)
            choice.update(people)
            chosen = [sample for number, sample in assigned if number == choice.number]
        self.counters.add("chosen", len(chosen))
        self.counters.add("other_person", len(frame) - min(len(chosen), 1))
        return chosen

    def _make(self, people: PeopleTracker) -> _People:
        return people, PersonChoice(self._rule, self._wearer)
