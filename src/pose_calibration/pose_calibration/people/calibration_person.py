"""Choice of the person used for calibration: the one whose views in the sensors agree."""

from collections import Counter, deque
from collections.abc import Iterable, Sequence
from operator import attrgetter

from pose_calibration.people.view_matching import rough_places, views_of_sensor
from pose_core.api import Extrinsics, PeopleTracker, SensorFrame, SkeletonSample
from pose_core.counters import Counters

MAX_NAMED = 4  # [-] ids that are named
REMEMBERED = 2_400  # [frames] 40 s of two sensors
GONE_S = 6.0  # [s] of absence after which another person is chosen
MATCH_AFTER_S = 5.0  # [s] of several people in view until they are matched
MATCH_AGAIN = 2.0  # [-] the time until the next match, to that until the one that failed
MATCH_WITHIN_S = 40.0  # [s] longest such time: all frames are new by then


def match_people(
    frames: Iterable[SensorFrame], sensors: Sequence[str]
) -> tuple[PeopleTracker, dict[int, list[SkeletonSample]]]:
    """Identify persons across sensors with unknown extrinsics.

    Args:
        frames: Frames of all sensors, each sensor's in the order of time.
        sensors: The sensors' names, the reference first.

    Returns:
        A tracker of them, in the reference's frame, approximately; and their samples by person, the
        longest common view first.
    """
    by_sensor: dict[str, list[SensorFrame]] = {name: [] for name in sensors}
    for frame in frames:
        if frame and frame[0].sensor in by_sensor:
            by_sensor[frame[0].sensor].append(frame)
    views = {name: views_of_sensor(ones) for name, ones in by_sensor.items()}
    placed, clocks = rough_places(views, sensors[0])
    tracker = PeopleTracker(placed, clocks)
    ordered = sorted(
        (frame for name in placed for frame in by_sensor[name]),
        key=lambda frame: tracker.stamp_ns(frame[0]),
    )
    persons: dict[int, list[SkeletonSample]] = {}
    for frame in ordered:
        for number, sample in tracker.add(frame):
            persons.setdefault(number, []).append(sample)
    if len(sensors) > 1:
        persons = {number: ones for number, ones in persons.items() if _in_common(ones)}
    by_view = sorted(persons.items(), key=lambda n: (_in_common(n[1]), len(n[1])), reverse=True)
    return tracker, dict(by_view)


def with_id(frame: SensorFrame, person: str) -> list[SkeletonSample]:
    """The persons with this id in a frame."""
    return [sample for sample in frame if sample.person == person][:1]


class CalibrationPerson:
    """Selects, frame by frame, the person used for calibration.

    While every frame has at most one person, that person is selected. From the first frame with
    several on, frames are stored until the views of one person have been matched.

    Args:
        sensors: The sensors' names, the reference first.
        person: The person's id in all sensors; if empty, selected as above.
    """

    def __init__(self, sensors: Sequence[str], person: str) -> None:
        self.counters = Counters(
            "nobody_seen", "chosen", "other_person", "held_frames", "matched", "not_matched"
        )
        self._sensors = tuple(sensors)
        self.person = person
        self._number = 0  # of the person, in the tracker
        self.restart()

    @property
    def missing(self) -> str:
        """Why nobody is selected, if the id is nobody's; empty otherwise."""
        if not self._other_ids:
            return ""
        there = ", ".join(repr(each) for each in sorted(self._other_ids))
        return f"nobody has the id {self.person!r} (person), only {there}: set it, or empty"

    @property
    def is_waiting(self) -> bool:
        """Whether there are several people whose views are not matched yet."""
        return self._is_several and self._tracker is None

    def choose_by(self, person: str) -> None:
        """Select the person of this id from now on; if empty, the one whose views agree."""
        self.person = person
        self.restart()

    def restart(self) -> None:
        """Drop all persons."""
        self._other_ids: set[str] = set()  # seen since the person's own was
        self._held: deque[SensorFrame] = deque(maxlen=REMEMBERED)
        self._extrinsics: Extrinsics | None = None
        self._tracker: PeopleTracker | None = None
        self._is_several = False
        self._next_match_ns: int | None = None
        self._match_after_s = MATCH_AFTER_S

    def use_extrinsics(self, extrinsics: Extrinsics) -> None:
        """Use estimated extrinsics to identify persons from now on."""
        self._extrinsics = extrinsics
        self._held.clear()

    def select(self, frame: SensorFrame) -> list[SkeletonSample]:
        """The person's samples of a frame; none while the person is not identified."""
        if not frame:
            self.counters.add("nobody_seen")
            return []
        chosen = self._select(frame)
        self.counters.add("chosen", len(chosen))
        self.counters.add("other_person", len(frame) - min(len(chosen), 1))
        return chosen

    def _select(self, frame: SensorFrame) -> list[SkeletonSample]:
        if self.person:
            return self._with_id(frame)
        if len(frame) > 1 and not self._is_several:
            self._is_several = True
            self._next_match_ns = frame[0].stamp_ns + round(self._match_after_s * 1e9)
            if self._extrinsics is not None:
                known = self._extrinsics
                places = {name: known.T_map_sensor(name) for name in known.sensors}
                self._tracker = PeopleTracker(places, known.clocks, known.rough_m)
        if self._tracker is not None:
            return self._tracked(self._tracker, frame)
        self._held.append(frame)
        if self._is_several:
            self.counters.add("held_frames")
            return []
        return list(frame)

    def _with_id(self, frame: SensorFrame) -> list[SkeletonSample]:
        chosen = with_id(frame, self.person)
        if chosen:
            self._other_ids.clear()
        elif len(self._other_ids) < MAX_NAMED:
            self._other_ids.update(sample.person for sample in frame)
        return chosen

    def match(self, stamp_ns: int) -> list[SkeletonSample]:
        """Match the views of all persons so far, if it is time for it.

        That is :data:`MATCH_AFTER_S` after several were seen; if no views agree, after longer and
        longer times, since one match of :data:`REMEMBERED` frames takes a second.

        Returns:
            All samples of one person, with which to restart the calibration; none if no person's
            views agree.
        """
        if not self.is_waiting or self._next_match_ns is None or stamp_ns < self._next_match_ns:
            return []
        self._match_after_s = min(MATCH_AGAIN * self._match_after_s, MATCH_WITHIN_S)
        self._next_match_ns = stamp_ns + round(self._match_after_s * 1e9)
        tracker, samples = match_people(self._held, self._sensors)
        if not samples:
            self.counters.add("not_matched")
            return []
        self.counters.add("matched")
        self._tracker, self._number = tracker, next(iter(samples))
        self._held.clear()
        return sorted(samples[self._number], key=attrgetter("stamp_ns"))

    def _tracked(self, tracker: PeopleTracker, frame: SensorFrame) -> list[SkeletonSample]:
        """The person's samples; after a long absence, another person's."""
        assigned = tracker.add(frame)
        chosen = tracker.track(self._number)
        if chosen is None or chosen.unseen_s(tracker.newest_ns) > GONE_S:
            self._number = next((track.number for track in tracker.present), 0)
        return [sample for number, sample in assigned if number == self._number]


def _in_common(samples: Sequence[SkeletonSample]) -> int:
    """Number of a sensor's frames with the person that another sensor has in common."""
    counts = Counter(sample.sensor for sample in samples)
    return len(samples) - max(counts.values(), default=0)
