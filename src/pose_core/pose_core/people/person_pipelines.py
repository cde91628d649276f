"""A :class:`Pipeline` for each person whose pose is estimated."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial

from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.errors import ParameterError
from pose_core.estimates.body_estimates import EstimateBlock
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.parameters import OTHER_ID
from pose_core.people.body_size import is_of_size
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.clocks import Clocks

COUNTERS = ("people_beyond_max", "measured_anew", "subject_changed")


class PersonPipelines:
    """Makes the pipelines, up to ``max_people``, and moves the subject's from person to person.

    A body shape from a file or a calibration is the subject's. It is dropped if the first person
    who is the subject turns out to be of another size, and when the subject becomes another person.

    Args:
        parameters: Of every pipeline; ``subject`` and ``max_people`` are used here.
        outlet: Receives a person's id and each block of their estimates.
        counters: Declares :data:`COUNTERS`.
        is_live: See :class:`Pipeline`.

    Raises:
        ParameterError: If ``subject`` is an id of other people.

    Attributes:
        subject: The subject's pipeline; there from the start.
        estimates: Number of estimates published, by id.
    """

    def __init__(
        self,
        parameters: PipelineParameters,
        outlet: Callable[[str, EstimateBlock], None],
        counters: Counters,
        *,
        is_live: bool,
    ) -> None:
        if parameters.max_people > 1 and OTHER_ID.fullmatch(parameters.subject):
            raise ParameterError(
                f"subject = '{parameters.subject}' is an id of other people, who are"
                " person_<number> with max_people above 1: choose another name"
            )
        self._parameters = parameters
        self._outlet = outlet
        self._counters = counters
        self._is_live = is_live
        self._extrinsics: Extrinsics | None = None
        self._alignments: SensorsToSegments = {}
        self._shape: BodyShape | None = None
        self._by_person: dict[int, Pipeline] = {}
        self._is_given_shape_used = True
        self._unchecked: int | None = None  # whose size is still to be compared with it
        self._is_subject_found = False
        self.estimates: dict[str, int] = {}
        self.subject = self._make(parameters.subject)

    def __iter__(self) -> Iterator[Pipeline]:
        """All pipelines, the subject's first."""
        yield self.subject
        yield from [each for each in self._by_person.values() if each is not self.subject]

    @property
    def people(self) -> Collection[int]:
        """Numbers of the people who have a pipeline."""
        return self._by_person.keys()

    def id_of(self, number: int) -> str:
        """The id under which a person's estimates are published."""
        is_subject = self._by_person.get(number) is self.subject
        return self._parameters.subject if is_subject else f"person_{number}"

    def shape_of(self, body_id: str) -> BodyShape | None:
        """The body shape of a person, by id; None while it is not known."""
        shapes = {self.id_of(number): each.shape for number, each in self._by_person.items()}
        return {**shapes, self._parameters.subject: self.subject.shape}.get(body_id)

    def use_extrinsics(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on."""
        self._extrinsics = extrinsics
        for pipeline in self:
            # The body shape of a calibration is the subject's.
            has_shape = pipeline is self.subject and self._is_given_shape_used
            own = extrinsics if has_shape else replace(extrinsics, body=None)
            pipeline.use_extrinsics(own)

    def use_clocks(self, clocks: Clocks) -> None:
        """Correct later stamps by these clocks."""
        if self._extrinsics is not None:
            self._extrinsics = replace(self._extrinsics, clocks=clocks)
        for pipeline in self:
            pipeline.use_clocks(clocks)

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use known alignments of the subject's IMUs; see :class:`Pipeline`."""
        self._alignments = alignments
        self.subject.use_sensor_to_segment(alignments)

    def use_shape(self, shape: BodyShape) -> None:
        """Take the subject's body shape as known."""
        self._shape = shape
        self.subject.use_shape(shape)

    def choose_subject(self, number: int) -> None:
        """Make this person the subject."""
        if self._by_person.get(number) is self.subject:
            return
        self._publish_waiting()
        if self._parameters.max_people == 1:
            self._by_person.clear()
            self._unchecked = None
        if self._is_subject_found:
            self._counters.add("subject_changed")
            self._is_given_shape_used = False
            self.subject = self._by_person.get(number) or self._make(self._parameters.subject)
            self.subject.use_sensor_to_segment(self._alignments)
        else:
            self._is_subject_found, self._unchecked = True, number
        self._assign(number, self.subject)

    def find(self, number: int, tracks: Sequence[PersonTrack]) -> Pipeline | None:
        """A person's pipeline, made if they have none; ``None`` if ``max_people`` have one.

        Args:
            number: The person.
            tracks: Everybody who is known. The pipelines of people who are not are removed.
        """
        pipeline = self._by_person.get(number)
        if pipeline is not None or self._parameters.max_people == 1:
            return pipeline
        others = sum(
            track.presence is Presence.PRESENT
            and self._by_person.get(track.number, self.subject) is not self.subject
            for track in tracks
        )
        if others >= self._parameters.max_people - 1:
            self._counters.add("people_beyond_max")
            return None
        self._publish_waiting()
        for unknown in set(self._by_person) - {track.number for track in tracks}:
            if self._by_person[unknown] is not self.subject:
                del self._by_person[unknown]
        return self._assign(number, self._make(f"person_{number}"))

    def check_given_shape(self, track: PersonTrack) -> None:
        """Restart a person without the given body shape if they are of another size."""
        of_calibration = None if self._extrinsics is None else self._extrinsics.body
        if track.number != self._unchecked or (self._shape is None and of_calibration is None):
            return
        pipeline = self._by_person[track.number]
        if pipeline.shape is None:
            return
        is_theirs = is_of_size(track.size, pipeline.shape)
        if is_theirs is not None:
            self._unchecked = None
        if is_theirs is not False:
            return
        self._publish_waiting()
        self._counters.add("measured_anew")
        self._is_given_shape_used = False
        restarted = self._make(pipeline.parameters.subject)
        if pipeline is self.subject:
            restarted.use_sensor_to_segment(self._alignments)
            self.subject = restarted
        self._assign(track.number, restarted)

    def _make(self, body_id: str) -> Pipeline:
        parameters = replace(self._parameters, subject=body_id)
        pipeline = Pipeline(parameters, is_live=self._is_live)
        if self._extrinsics is not None:
            pipeline.use_extrinsics(replace(self._extrinsics, body=None))
        return pipeline

    def _assign(self, number: int, pipeline: Pipeline) -> Pipeline:
        self._by_person[number] = pipeline
        pipeline.outlet = partial(self._publish, number)
        return pipeline

    def _publish_waiting(self) -> None:
        """Publish what waits, before anybody's id changes or a pipeline is removed."""
        for pipeline in self:
            pipeline.publish_waiting()

    def _publish(self, number: int, block: EstimateBlock) -> None:
        body_id = self.id_of(number)
        self.estimates[body_id] = self.estimates.get(body_id, 0) + len(block)
        self._outlet(body_id, block)
