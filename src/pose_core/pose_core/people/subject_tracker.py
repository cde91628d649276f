"""Everybody in one common frame, and who of them is the subject."""

from collections.abc import Sequence

from pose_core.people.person_choice import IMUS, PersonChoice
from pose_core.people.track_manager import Assigned
from pose_core.people.tracker import PeopleTracker
from pose_core.people.wearer import WearerSearch
from pose_core.streams.samples import SkeletonSample


class SubjectTracker:
    """Assigns skeletons to persons and chooses the subject among them.

    Args:
        people: Assigns the skeletons.
        rule: See :class:`PersonChoice`.
        wearer: Compares people with the IMUs, for the rule ``imus``; its IMU samples are added by
            the caller.
    """

    def __init__(self, people: PeopleTracker, rule: str, wearer: WearerSearch) -> None:
        self.people = people
        self.choice = PersonChoice(rule)
        self._wearer = wearer

    @property
    def uses_imus(self) -> bool:
        """Whether the rule needs IMU samples."""
        return self.choice.rule == IMUS

    def add(self, frame: Sequence[SkeletonSample]) -> list[Assigned]:
        """Assign a frame's skeletons (see :meth:`PeopleTracker.add`), then choose the subject."""
        people, wearer = self.people, None
        assigned = people.add(frame)
        if not frame:
            return assigned
        stamp_ns = people.newest_ns
        if self.uses_imus:
            for track in people.present:
                if track.last_seen_ns == stamp_ns:
                    self._wearer.add(track.number, stamp_ns, track.positions)
            wearer = self._wearer.wearer()
        first_sensor = next(iter(people.T_common_sensor.values()))[:3, 3]
        self.choice.update(people.tracks, stamp_ns, first_sensor, wearer)
        return assigned
