"""One person's skeletons, out of frames that show several people."""

from collections.abc import Sequence

import numpy as np

from pose_core.counters import Counters
from pose_core.people.person_choice import FIRST, IMUS, NEAREST, PersonChoice
from pose_core.people.tracker import PeopleTracker
from pose_core.people.wearer import WearerSearch
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.samples import ImuBlock, SkeletonSample


class ChosenPerson:
    """Selects one person's skeletons, as :class:`PeoplePipeline` selects its subject's.

    Without extrinsics the rule is applied in each sensor by itself, and a rule that is a sensor's
    id selects by the id alone.

    Args:
        rule: See :class:`PersonChoice`.
        extrinsics: The sensors' poses, if they are known.
    """

    def __init__(self, rule: str = "", extrinsics: Extrinsics | None = None) -> None:
        self.counters = Counters("nobody_seen", "followed", "other_person")
        self._rule = rule
        self._wearer = WearerSearch()
        self._everywhere: tuple[PeopleTracker, PersonChoice] | None = None
        self._by_sensor: dict[str, tuple[PeopleTracker, PersonChoice]] = {}
        if extrinsics is not None:
            self.use_extrinsics(extrinsics)

    def use_extrinsics(self, extrinsics: Extrinsics) -> None:
        """Assign the skeletons of all sensors together from now on."""
        places = {name: extrinsics.T_map_sensor(name) for name in extrinsics.sensors}
        self._everywhere = self._make(PeopleTracker(places, extrinsics.clocks))

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
            people, choice = self._people_of(frame[0].sensor)
            assigned = people.add(frame)
            choice.update(people)
            chosen = [sample for number, sample in assigned if number == choice.number]
        self.counters.add("followed", len(chosen))
        self.counters.add("other_person", len(frame) - min(len(chosen), 1))
        return chosen

    def _people_of(self, sensor: str) -> tuple[PeopleTracker, PersonChoice]:
        if self._everywhere is not None and sensor in self._everywhere[0].T_common_sensor:
            return self._everywhere
        if sensor not in self._by_sensor:
            self._by_sensor[sensor] = self._make(PeopleTracker({sensor: np.eye(4)}))
        return self._by_sensor[sensor]

    def _make(self, people: PeopleTracker) -> tuple[PeopleTracker, PersonChoice]:
        return people, PersonChoice(self._rule, self._wearer)
