"""Poses of several people: one :class:`Pipeline` for each person, live and offline alike.

Its input are the sensors' frames with everybody in them. The subject's estimates are published
under the parameter ``subject``, everybody else's as ``person_<number>``; a number is never used
again for another person.
"""

from collections import Counter, deque
from collections.abc import Callable

from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimates.body_estimates import EstimateBlock
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion import sample_buffer
from pose_core.fusion.pipeline import Pipeline
from pose_core.fusion.sample_buffer import SampleBuffer
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.people import person_pipelines
from pose_core.people.person_choice import PersonChoice
from pose_core.people.person_pipelines import PersonPipelines
from pose_core.people.tracker import PeopleTracker
from pose_core.session.extrinsics import Extrinsics
from pose_core.stamps import JUMP_BACK_NS
from pose_core.streams.clocks import Clocks
from pose_core.streams.repeated_frames import RepeatedFrames
from pose_core.streams.samples import ImuBlock, ImuSample, SensorFrame, block_of

MAX_HELD_NS = 9 * JUMP_BACK_NS // 10  # [ns] live, older skeletons would look like a new start


class PeoplePipeline:
    """Turns frames of several people and IMU samples into estimates of each one's pose.

    Args:
        parameters: See :class:`PipelineParameters`; ``person`` and ``max_people`` are used here.
        outlet: Receives a person's id and each block of their estimates, as soon as it is there.
        extrinsics: Where the sensors are; may come later (:meth:`use_extrinsics`).
        is_live: See :class:`Pipeline`.

    Attributes:
        choice: The choice of the subject, by the rule ``person``.
        extrinsics: The sensors' poses, once they are known.
        clocks: The clocks by which stamps are corrected.
        frames: Number of frames added.
        skeletons: Number of skeletons that were given to a person's pipeline.
        subject_frames: Number of frames of the subject, by sensor.
        repeated_frames: Number of frames of a recording left out since their sensor repeats one
            frame, by sensor; live, they are not added.
        most_at_once: Largest number of people in one camera's frame.
        imu_samples: Number of IMU samples added.
        estimates: Number of estimates published, by id.
    """

    def __init__(
        self,
        parameters: PipelineParameters,
        outlet: Callable[[str, EstimateBlock], None],
        extrinsics: Extrinsics | None = None,
        *,
        is_live: bool = False,
    ) -> None:
        self.parameters = parameters
        self.extrinsics: Extrinsics | None = None
        self.clocks: Clocks = {}
        self.frames = 0
        self.skeletons = 0
        self.most_at_once = 0
        self.subject_frames: dict[str, int] = {}
        self.repeated_frames: Counter[str] = Counter()
        self.imu_samples = 0
        self._counters = Counters(
            "frames_before_extrinsics",
            *sample_buffer.COUNTERS,
            "skeletons_of_others",
            "skeletons_held_too_long",
            *person_pipelines.COUNTERS,
        )
        self._people = PeopleTracker({})
        self.choice = PersonChoice(parameters.person)
        self._is_live = is_live
        self._repeated = RepeatedFrames()
        self._waiting: SampleBuffer[SensorFrame] = SampleBuffer(self._counters)
        self._held_imus: deque[tuple[int, ImuBlock]] = deque()  # with the newest frame's stamp [ns]
        self._pipelines = PersonPipelines(parameters, outlet, self._counters, is_live=is_live)
        self.estimates = self._pipelines.estimates
        if extrinsics is not None:
            self.use_extrinsics(extrinsics)

    @property
    def subject(self) -> Pipeline:
        """The subject's pipeline; it is there before anybody is."""
        return self._pipelines.subject

    @property
    def people(self) -> tuple[str, ...]:
        """The ids of the people in view whose pose is estimated, the subject first."""
        present = {track.number for track in self._people.present}
        ids = [self._pipelines.id_of(n) for n in self._pipelines.people if n in present]
        return tuple(sorted(ids, key=lambda each: (each != self.parameters.subject, each)))

    @property
    def remembered(self) -> frozenset[str]:
        """The ids of the subject and of everybody in view or who may come back."""
        known = (self._pipelines.id_of(track.number) for track in self._people.tracks)
        return frozenset({self.parameters.subject, *known})

    @property
    def others(self) -> int:
        """Number of people in view whose pose is not estimated."""
        return sum(track.number not in self._pipelines.people for track in self._people.present)

    @property
    def people_counts(self) -> dict[str, int]:
        """Counts of people who came, went and came back, and of samples that were not used."""
        return {**self._people.counters.as_dict(), **self._counters.as_dict()}

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return any(pipeline.holds_frames for pipeline in self._pipelines)

    @property
    def is_undecided(self) -> bool:
        """Whether it is not decided yet who somebody in view is."""
        return self._people.holds_back

    @property
    def is_doubted(self) -> bool:
        """Whether the subject came back with another size than before, and may be somebody else."""
        return self.choice.number in self._people.differing

    @property
    def status(self) -> str:
        """State of the subject's pipeline, as text for people."""
        is_chosen = self.choice.number is not None
        if self.extrinsics is not None and self._people.present and not is_chosen:
            return f"nobody is chosen yet by person = {self.choice.rule}"
        return self.subject.status

    def shape_of(self, body_id: str) -> BodyShape | None:
        """The body shape of a person, by id; ``None`` while it is not known."""
        return self._pipelines.shape_of(body_id)

    def use_extrinsics(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on."""
        self.extrinsics, self.clocks = extrinsics, extrinsics.clocks
        known = [name for name in self.parameters.sensors if name in extrinsics.sensors]
        poses = {name: extrinsics.T_map_sensor(name) for name in known}
        self._people.place_sensors(poses, extrinsics.clocks, extrinsics.rough_m)
        while self._waiting:
            self._take(self._waiting.popleft())
        self._pipelines.use_extrinsics(extrinsics)

    def use_clocks(self, clocks: Clocks) -> None:
        """Correct later stamps by these clocks."""
        self.clocks = self._people.clocks = clocks
        self._pipelines.use_clocks(clocks)

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use known alignments; headings and other IMUs are still aligned from motion."""
        self._pipelines.use_sensor_to_segment(alignments)

    def use_shape(self, shape: BodyShape) -> None:
        """Take the subject's body shape as known; a person of another size is measured."""
        self._pipelines.use_shape(shape)

    def add(self, sample: SensorFrame | ImuSample | ImuBlock) -> None:
        """Take a frame with everybody in it, or IMU samples: the subject wears the IMUs."""
        if isinstance(sample, ImuSample):
            sample = block_of(sample)
        if isinstance(sample, ImuBlock):
            self.imu_samples += len(sample)
        else:
            self.frames += 1
            if self._is_frozen(sample):
                self.repeated_frames[sample[0].sensor] += 1
                return
        if self.extrinsics is not None or not len(sample):
            self._take(sample)
            return
        if not isinstance(sample, ImuBlock):
            self._counters.add("frames_before_extrinsics")
        self._waiting.add(sample)

    def _is_frozen(self, frame: SensorFrame) -> bool:
        """Whether a recording's frame is one that its sensor repeats."""
        if self._is_live or not frame:
            return False
        return self._repeated.is_frozen(frame[0].sensor, frame)

    def _take(self, sample: SensorFrame | ImuBlock) -> None:
        if isinstance(sample, ImuBlock):
            self._take_imus(sample)
        else:
            self._take_frame(sample)

    def release_held(self) -> None:
        """Process the frames that wait for others: a live caller's patience has ended."""
        for pipeline in self._pipelines:
            pipeline.release_held()

    def flush(self) -> None:
        """Process everything that waits: the streams have ended."""
        self._release_imus()
        for pipeline in self._pipelines:
            pipeline.flush()

    def publish_until(self, now_ns: int) -> None:
        """Publish everybody's predicted estimates of the output's instants up to now [ns]."""
        for pipeline in self._pipelines:
            pipeline.publish_until(now_ns)

    def _take_imus(self, block: ImuBlock) -> None:
        self.choice.add_imus(block)
        if self.parameters.use_imus:
            self._people.add_imus(block)
        # A recording's skeletons that are held back come with their IMUs; live there is no time.
        if self._people.holds_back and not self._is_live:
            self._held_imus.append((self._people.newest_ns, block))
        else:
            self._release_imus()
            self.subject.add(block)

    def _release_imus(self, before_ns: int | None = None) -> None:
        """Give the subject the IMU samples that arrived before a frame's instant, or all."""
        held = self._held_imus
        while held and (before_ns is None or held[0][0] < before_ns):
            self.subject.add(held.popleft()[1])

    def _take_frame(self, frame: SensorFrame) -> None:
        if frame and frame[0].sensor not in self._people.T_common_sensor:
            self.subject.add(frame[0])  # is counted there
            return
        assigned = self._people.add(frame)
        self.most_at_once = max(self.most_at_once, len(frame))
        if frame:
            self.choice.update(self._people)
            if self.choice.number is not None:
                self._pipelines.choose_subject(self.choice.number)
        for number, sample in assigned:
            stamp_ns = self._people.stamp_ns(sample)
            held_ns = self._people.stamp_ns(frame[0]) - stamp_ns
            if self._is_live and held_ns > MAX_HELD_NS:
                self._counters.add("skeletons_held_too_long")
                continue
            self._release_imus(stamp_ns)
            pipeline = self._pipelines.find(number, self._people.tracks)
            if pipeline is None:
                self._counters.add("skeletons_of_others")
                continue
            self.skeletons += 1
            if pipeline is self.subject:
                self.subject_frames[sample.sensor] = self.subject_frames.get(sample.sensor, 0) + 1
            pipeline.add(sample)
            track = self._people.track(number)
            if track is not None:
                self._pipelines.check_given_shape(track)
