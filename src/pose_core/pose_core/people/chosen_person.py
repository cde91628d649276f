"""One person's skeletons, out of frames that show several people."""

from collections.abc import Sequence

import numpy as np

from pose_core.counters import Counters
from pose_core.people.choice import FIRST, IMUS, NEAREST, PersonChoice
from pose_core.people.tracker import PeopleTracker
from pose_core.people.wearer import WearerSearch
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.samples import ImuBlock, SkeletonSample


class ChosenPerson:
    """Follows one person, as :class:`PeoplePipeline` does its subject.

    Where it is not known how the sensors stand, each sensor's own person is followed by the rule;
    an id, which then is all that there is, is believed.

    Args:
        rule: See :class:`PersonChoice`.
        extrinsics: How the sensors stand.
    """

    def __init__(self, rule: str = "", extrinsics: Extrinsics | None = None) -> None:
        self.counters = Counters("nobody_seen", "followed", "other_person")
        self._rule = rule
        self._wearer = WearerSearch()
        self._common: _Following | None = None
        self._by_sensor: dict[str, _Following] = {}
        if extrinsics is not None:
            self.place_sensors(extrinsics)

    @property
    def most_people(self) -> int:
        """How many different people there have been, at least."""
        followings = [*self._by_sensor.values(), *([self._common] if self._common else [])]
        return max((each.tracker.counters["came"] for each in followings), default=0)

    def place_sensors(self, extrinsics: Extrinsics) -> None:
        """Assign the skeletons of all sensors together from now on."""
        places = {name: extrinsics.T_map_sensor(name) for name in extrinsics.sensors}
        tracker = PeopleTracker(places, extrinsics.clocks)
        self._common = _Following(tracker, PersonChoice(self._rule))

    def follow(self, rule: str) -> None:
        """Choose anew, by another rule."""
        self._rule = rule
        self._by_sensor.clear()
        if self._common is not None:
            self._common.choice.follow(rule)

    def add_imus(self, block: ImuBlock) -> None:
        """Take what IMUs felt, for the rule ``imus``."""
        if self._rule == IMUS:
            self._wearer.add_imus(block)

    def select(self, frame: Sequence[SkeletonSample]) -> list[SkeletonSample]:
        """The person's skeletons of a sensor's frame: one, none, or those held back until now."""
        if not frame:
            self.counters.add("nobody_seen")
            return []
        if self._common is None and self._rule not in ("", FIRST, NEAREST, IMUS):
            chosen = [sample for sample in frame if sample.person == self._rule][:1]
        else:
            chosen = self._following(frame[0].sensor).select(frame, self._wearer, self._rule)
        self.counters.add("followed", len(chosen))
        self.counters.add("other_person", len(frame) - min(len(chosen), 1))
        return chosen

    def _following(self, sensor: str) -> "_Following":
        if self._common is not None and sensor in self._common.tracker.T_common_sensor:
            return self._common
        if sensor not in self._by_sensor:
            tracker = PeopleTracker({sensor: np.eye(4)})
            self._by_sensor[sensor] = _Following(tracker, PersonChoice(self._rule))
        return self._by_sensor[sensor]


class _Following:
    """Who is who in one common frame, and who of them is chosen."""

    def __init__(self, tracker: PeopleTracker, choice: PersonChoice) -> None:
        self.tracker = tracker
        self.choice = choice

    def select(
        self, frame: Sequence[SkeletonSample], wearer: WearerSearch, rule: str
    ) -> list[SkeletonSample]:
        tracker = self.tracker
        assigned = tracker.add(frame)
        stamp_ns = tracker.newest_ns
        if rule == IMUS:
            for track in tracker.present:
                if track.seen_ns == stamp_ns:
                    wearer.add(track.number, stamp_ns, track.positions)
        place = next(iter(tracker.T_common_sensor.values()))[:3, 3]
        found = wearer.wearer() if rule == IMUS else None
        self.choice.update(tracker.tracks, stamp_ns, place, found)
        return [sample for number, sample in assigned if number == self.choice.number]
