"""Whom to calibrate with: the only person that a sensor sees."""

from collections.abc import Sequence

from pose_core.counters import Counters
from pose_core.streams.person_selection import PersonSelector
from pose_core.streams.samples import SkeletonSample


class SinglePersonSelector(PersonSelector):
    """Takes a sensor's frame where it shows one person; who is who between sensors is not known.

    Args:
        person: The id, in all sensors, of the person to take from frames with several; empty to
            leave such frames out.
    """

    def __init__(self, person: str = "") -> None:
        super().__init__(person)
        self.counters = Counters(*self.counters.as_dict(), "several_persons")

    def select(self, persons: Sequence[SkeletonSample]) -> SkeletonSample | None:
        """The person, or None if there is nobody or no telling."""
        if len(persons) > 1 and not self._person:
            self.counters.add("several_persons")
            return None
        return super().select(persons)
