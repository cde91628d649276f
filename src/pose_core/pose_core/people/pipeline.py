"""A pose for each of several people: one :class:`FusionPipeline` a person, live and offline alike.

Frames go in as the sensors give them, with everybody in them. The chosen person's estimates go out
under the parameter ``subject``, everybody else's as ``person_<number>``, whose number never stands
for anybody else.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.filter.imu_use import ImuUse
from pose_core.fusion.estimates import EstimateBlock
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pipeline import FusionPipeline
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.people.body_size import is_of_size
from pose_core.people.choice import IMUS, PersonChoice
from pose_core.people.tracker import PeopleTracker
from pose_core.people.wearer import WearerSearch
from pose_core.session.clocks import Clocks
from pose_core.session.extrinsics import Extrinsics
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample, block_of

WAITS_S = 30  # [s] of samples are kept until it is known where the sensors are
Frame = Sequence[SkeletonSample]


class PeoplePipeline:
    """Turns frames of several people and IMU samples into estimates of each one's pose.

    Args:
        parameters: See :class:`FusionParameters`; ``person`` and ``max_people`` are used here.
        outlet: Is given an id and that person's estimates, as soon as they are there.
        extrinsics: Where the sensors are; may come later (:meth:`place_sensors`).
        is_live: See :class:`FusionPipeline`.
    """

    def __init__(
        self,
        parameters: FusionParameters,
        outlet: Callable[[str, EstimateBlock], None],
        extrinsics: Extrinsics | None = None,
        *,
        is_live: bool = False,
    ) -> None:
        self._is_live = is_live
        self.parameters = parameters
        self.choice = PersonChoice(parameters.person)
        self._own_counters = Counters(
            "frames_before_extrinsics",
            "skeletons_of_others",
            "people_beyond_max",
            "measured_anew",
            "subject_changed",
        )
        self.extrinsics: Extrinsics | None = None
        self.estimates: dict[str, int] = {}  # how many have gone out, by id
        self.frames = 0  # that sensors gave
        self.skeletons = 0  # that were given to somebody's chain
        self.imu_samples = 0
        self._outlet = outlet
        self._clocks: Clocks = {}
        self._mountings: SensorsToSegments = {}
        self._shape: BodyShape | None = None
        self._tracker = PeopleTracker({})
        self._wearer = WearerSearch()
        self._waiting: deque[Frame | ImuBlock] = deque()
        self._newest_ns = 0
        self._followed: dict[int, FusionPipeline] = {}
        self._given: set[int] = set()  # whose measures were given, and are not compared yet
        self._has_given_measures = True  # the subject takes measures of files
        self._is_free = True  # the subject's pipeline has followed nobody yet
        self.subject = self._make(parameters.subject)
        """The chosen person's chain; it is there before anybody is."""
        if extrinsics is not None:
            self.place_sensors(extrinsics)

    @property
    def model(self) -> BodyModel:
        """The body model, the same of everybody."""
        return self.subject.model

    @property
    def people(self) -> tuple[str, ...]:
        """The ids of those in sight whose pose is estimated, the subject first."""
        here = {track.number for track in self._tracker.present}
        ids = [self.id_of(number) for number in self._followed if number in here]
        return tuple(sorted(ids, key=lambda each: (each != self.parameters.subject, each)))

    @property
    def others(self) -> int:
        """How many people are in sight whose pose is not estimated."""
        return sum(track.number not in self._followed for track in self._tracker.present)

    @property
    def counters(self) -> Counters:
        """The counts of the subject's chain."""
        return self.subject.counters

    @property
    def people_counts(self) -> dict[str, int]:
        """What became of people: how many came, went, came back, were not followed."""
        return {**self._tracker.counters.as_dict(), **self._own_counters.as_dict()}

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """What becomes of each IMU that was heard; the subject wears them."""
        return self.subject.imu_uses

    @property
    def clocks(self) -> Clocks:
        """By which stamps are corrected."""
        return self._clocks

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return any(pipeline.holds_frames for pipeline in self._pipelines())

    @property
    def status(self) -> str:
        """What the subject's chain is doing, for people."""
        if self.extrinsics is None:
            return self.subject.status
        if self.choice.number is None and self._tracker.present:
            return f"nobody is chosen yet by person = {self.choice.rule}"
        return self.subject.status

    def shape_of(self, body_id: str) -> BodyShape | None:
        """The measures of somebody whose pose is estimated, once they are known."""
        if body_id == self.parameters.subject:
            return self.subject.shape
        number = next((each for each in self._followed if self.id_of(each) == body_id), None)
        return None if number is None else self._followed[number].shape

    def id_of(self, number: int) -> str:
        """Under which id a person's estimates go out."""
        is_subject = self._followed.get(number) is self.subject
        return self.parameters.subject if is_subject else f"person_{number}"

    def follow(self, rule: str) -> None:
        """Choose the subject anew, by another rule."""
        self.choice.follow(rule)

    def place_sensors(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on."""
        self.extrinsics, self._clocks = extrinsics, extrinsics.clocks
        known = [name for name in self.parameters.sensors if name in extrinsics.sensors]
        places = {name: extrinsics.T_map_sensor(name) for name in known}
        self._tracker.place_sensors(places, extrinsics.clocks)
        while self._waiting:
            waiting = self._waiting.popleft()
            if isinstance(waiting, ImuBlock):
                self._take_imus(waiting)
            else:
                self._take(waiting)
        for pipeline in self._pipelines():
            pipeline.place_sensors(self._extrinsics_for(pipeline, extrinsics))

    def use_clocks(self, clocks: Clocks) -> None:
        """Put stamps right by these clocks from now on."""
        self._clocks = self._tracker.clocks = clocks
        for pipeline in self._pipelines():
            pipeline.use_clocks(clocks)

    def use_sensor_to_segment(self, mountings: SensorsToSegments) -> None:
        """Take how these IMUs sit from a calibration, instead of finding it from motion."""
        self._mountings = mountings
        self.subject.use_sensor_to_segment(mountings)

    def use_shape(self, shape: BodyShape) -> None:
        """Take the subject's measures as known; somebody of another size is measured anew."""
        self._shape = shape
        self.subject.use_shape(shape)

    def add(self, sample: Frame | ImuSample | ImuBlock) -> None:
        """Take a frame with everybody in it, or IMUs' samples."""
        if isinstance(sample, ImuSample | ImuBlock):
            self.add_imu(sample)
        else:
            self.add_frame(sample)

    def add_frame(self, frame: Frame) -> None:
        """Take all that a sensor saw at one instant."""
        self.frames += 1
        if self.extrinsics is None and frame:
            self._own_counters.add("frames_before_extrinsics")
            self._wait(frame, frame[0].stamp_ns)
            return
        self._take(frame)

    def add_imu(self, samples: ImuSample | ImuBlock) -> None:
        """Take IMUs' orientations: the subject wears them."""
        block = block_of(samples) if isinstance(samples, ImuSample) else samples
        self.imu_samples += len(block)
        if self.extrinsics is None:
            if len(block):
                self._wait(block, int(block.stamps_ns[-1]))
            return
        self._take_imus(block)

    def _take_imus(self, block: ImuBlock) -> None:
        if self.choice.rule == IMUS:
            self._wearer.add_imus(block)
        self.subject.add_imu(block)

    def wait_no_longer(self) -> None:
        """Go on without the frames that others wait for: a live caller's patience has ended."""
        for pipeline in self._pipelines():
            pipeline.wait_no_longer()

    def flush(self) -> None:
        """Wait for nothing more: the streams have ended."""
        for pipeline in self._pipelines():
            pipeline.flush()

    def calibrate_session(self) -> None:
        """Calibrate with the last frames, whose estimates have been published before."""
        for pipeline in self._pipelines():
            pipeline.calibrate_session()

    def publish_until(self, now_ns: int) -> None:
        """Everybody's estimates of the output's instants up to now, predicted."""
        for pipeline in self._pipelines():
            pipeline.publish_until(now_ns)

    def _pipelines(self) -> list[FusionPipeline]:
        others = (each for each in self._followed.values() if each is not self.subject)
        return [self.subject, *others]

    def _wait(self, sample: Frame | ImuBlock, stamp_ns: int) -> None:
        self._waiting.append(sample)
        self._newest_ns = max(self._newest_ns, stamp_ns)
        while _stamp_ns(self._waiting[0]) < self._newest_ns - WAITS_S * NS_PER_S:
            self._waiting.popleft()

    def _take(self, frame: Frame) -> None:
        known = self._tracker.T_common_sensor
        if frame and frame[0].sensor not in known:
            self.subject.add_skeleton(frame[0])  # is counted there
            return
        assigned = self._tracker.add(frame)
        if not frame:
            return
        stamp_ns = self._tracker.newest_ns
        if self.choice.rule == IMUS:
            self._compare_with_imus(stamp_ns)
        place = known[next(iter(known))][:3, 3]
        wearer = self._wearer.wearer() if self.choice.rule == IMUS else None
        self.choice.update(self._tracker.tracks, stamp_ns, place, wearer)
        self._follow_chosen()
        for number, sample in assigned:
            pipeline = self._pipeline_of(number)
            if pipeline is None:
                self._own_counters.add("skeletons_of_others")
                continue
            self.skeletons += 1
            pipeline.add_skeleton(sample)
            if number in self._given:
                self._compare_measures(number)

    def _compare_with_imus(self, stamp_ns: int) -> None:
        for track in self._tracker.present:
            if track.seen_ns == stamp_ns:
                self._wearer.add(track.number, stamp_ns, track.positions)

    def _follow_chosen(self) -> None:
        """Let the subject's chain follow the chosen person."""
        number = self.choice.number
        if number is None or self._followed.get(number) is self.subject:
            return
        if self.parameters.max_people == 1:
            self._followed.clear()
            self._given.clear()
        if not self._is_free:
            self._own_counters.add("subject_changed")
            self._has_given_measures = False
            self.subject = self._followed.get(number) or self._make(self.parameters.subject)
            self.subject.use_sensor_to_segment(self._mountings)
        self._is_free = False
        self._followed[number] = self.subject
        self._aim(self.subject, number)
        has_body = self.extrinsics is not None and self.extrinsics.body is not None
        if self._has_given_measures and (self._shape is not None or has_body):
            self._given.add(number)

    def _pipeline_of(self, number: int) -> FusionPipeline | None:
        pipeline = self._followed.get(number)
        if pipeline is not None or self.parameters.max_people == 1:
            return pipeline
        here = {track.number for track in self._tracker.present}
        others = [
            each
            for each, followed in self._followed.items()
            if each in here and followed is not self.subject
        ]
        if len(others) >= self.parameters.max_people - 1:
            self._own_counters.add("people_beyond_max")
            return None
        self._forget_unknown()
        pipeline = self._followed[number] = self._make(f"person_{number}")
        self._aim(pipeline, number)
        return pipeline

    def _forget_unknown(self) -> None:
        """Let go of the chains of those whom nobody remembers."""
        for number in [each for each in self._followed if self._tracker.track(each) is None]:
            if self._followed[number] is not self.subject:
                del self._followed[number]

    def _make(self, body_id: str) -> FusionPipeline:
        parameters = replace(self.parameters, subject=body_id)
        pipeline = FusionPipeline(parameters, is_live=self._is_live)
        if self.extrinsics is not None and not self._waiting:
            bare = replace(self.extrinsics, clocks=self._clocks, body=None)
            pipeline.place_sensors(bare)
        return pipeline

    def _extrinsics_for(self, pipeline: FusionPipeline, extrinsics: Extrinsics) -> Extrinsics:
        """Measures that a calibration took are its person's, not everybody's."""
        is_theirs = pipeline is self.subject and self._has_given_measures
        return extrinsics if is_theirs else replace(extrinsics, body=None)

    def _aim(self, pipeline: FusionPipeline, number: int) -> None:
        pipeline.outlet = partial(self._send, number)

    def _send(self, number: int, block: EstimateBlock) -> None:
        body_id = self.id_of(number)
        self.estimates[body_id] = self.estimates.get(body_id, 0) + len(block)
        self._outlet(body_id, block)

    def _compare_measures(self, number: int) -> None:
        """Give up measures that came from a file or a calibration where they are not theirs."""
        track, pipeline = self._tracker.track(number), self._followed[number]
        if track is None or pipeline.shape is None:
            return
        fits = is_of_size(track.size, pipeline.shape)
        if fits is None:
            return
        self._given.discard(number)
        if not fits:
            self._own_counters.add("measured_anew")
            self._restart(number)

    def _restart(self, number: int) -> None:
        """Begin somebody's chain anew, without any measures."""
        self._has_given_measures = False
        pipeline = self._make(self._followed[number].parameters.subject)
        if self._followed[number] is self.subject:
            pipeline.use_sensor_to_segment(self._mountings)
            self.subject = pipeline
        self._followed[number] = pipeline
        self._aim(pipeline, number)


def _stamp_ns(sample: Frame | ImuBlock) -> int:
    return int(sample.stamps_ns[-1]) if isinstance(sample, ImuBlock) else sample[0].stamp_ns
