"""The chain from samples to estimates, the same object live and offline.

Samples of several Kinects are brought into ``map``, used first to measure the body and then handed
to the estimator, with the IMUs' orientations of the same instant. An estimator that wants all
sensors at common instants gets them aligned in time (li2020 (2)); any other gets each sensor's
frame as it comes. What comes out depends on the samples alone, never on a clock.
"""

from collections.abc import Callable, Iterable

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.registry import body_model_of
from pose_core.filter.imu_use import ImuUse
from pose_core.fusion.estimates import BodyEstimate, EstimateBlock
from pose_core.fusion.estimation import Estimation
from pose_core.fusion.observation import Observation
from pose_core.fusion.observer import COUNTERS, Observer
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.tracking import tracking_counters
from pose_core.imu.imu_set import ImuSet
from pose_core.imu.mounting import Mountings
from pose_core.session.clocks import Clocks
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample
from pose_core.streams.time_alignment import TimeAligner


class FusionPipeline:
    """Turns skeleton and IMU samples into estimates of one person's pose.

    Args:
        parameters: See :class:`FusionParameters`.
        extrinsics: Where the sensors are; may come later (:meth:`place_sensors`).
        shape: The person's measures; measured from the first samples if None.
    """

    def __init__(
        self,
        parameters: FusionParameters,
        extrinsics: Extrinsics | None = None,
        shape: BodyShape | None = None,
    ) -> None:
        self.parameters = parameters
        self.model: BodyModel = body_model_of(parameters)
        self.counters = Counters(*COUNTERS, *tracking_counters(parameters))
        self._estimation = Estimation(self.model, parameters, self.counters)
        self._observer = Observer(self.model, parameters, self.counters)
        self.outlet: Callable[[EstimateBlock], None] | None = None
        """Is given all estimates at once, before the next frame is looked at; none are returned."""
        if extrinsics is not None:
            self.place_sensors(extrinsics)
        if shape is not None:
            self.use_shape(shape)

    @property
    def extrinsics(self) -> Extrinsics | None:
        """Where the sensors are, once it is known."""
        return self._observer.extrinsics

    @property
    def clocks(self) -> Clocks:
        """By which stamps are put right."""
        return self._observer.clocks

    @property
    def shape(self) -> BodyShape | None:
        """The person's measures, once they are known."""
        return self._observer.shape

    @property
    def imus(self) -> ImuSet:
        """The IMUs that have spoken."""
        return self._observer.imus

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """What becomes of each IMU that was heard, by segment's name."""
        uses = {use.segment: use for use in self._estimation.imu_uses}
        return tuple(uses.get(name) or self._unused(name) for name in sorted(self.imus.segments))

    def _unused(self, segment: str) -> ImuUse:
        """Of an IMU that the estimator has not been given."""
        if not self.parameters.use_imus:
            return ImuUse(segment=segment, refused="use_imus is false: set it to true")
        if self.counters["estimates"] == 0:
            return ImuUse(segment=segment, refused="no pose yet: the cameras must see the person")
        name = self.parameters.estimator
        return ImuUse(segment=segment, refused=f"the estimator {name} uses no IMUs: use default")

    @property
    def aligner(self) -> TimeAligner:
        """Brings all sensors to common instants, if the estimator wants that."""
        return self._observer.aligner

    @property
    def status(self) -> str:
        """What the chain is doing, for people."""
        return self._observer.status

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return self._observer.holds_frames

    def place_sensors(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on; see :meth:`Observer.place_sensors`.

        Estimates of the past are not made.
        """
        self._observer.place_sensors(extrinsics)

    def use_mountings(self, mountings: Mountings) -> None:
        """Take how these IMUs sit from a calibration, instead of finding it from motion."""
        self._estimation.use_mountings(mountings)

    def use_clocks(self, clocks: Clocks) -> None:
        """Put stamps right by these clocks from now on; what came before stays where it is."""
        self._observer.clocks = clocks

    def use_shape(self, shape: BodyShape) -> None:
        """Track a body of these measures from now on."""
        self._observer.shape = shape

    def add(self, sample: SkeletonSample | ImuSample | ImuBlock) -> list[BodyEstimate]:
        """Take a sample of any source; returns the estimates that this completes."""
        return self._estimated(self._observer.add(sample))

    def add_skeleton(self, sample: SkeletonSample) -> list[BodyEstimate]:
        """Take one person's joints from one sensor; returns the estimates that this completes."""
        return self._estimated(self._observer.add(sample))

    def add_imu(self, samples: ImuSample | ImuBlock) -> list[BodyEstimate]:
        """Take IMUs' orientations; returns the estimates that were waiting for them."""
        return self._estimated(self._observer.add(samples))

    def wait_no_longer(self) -> list[BodyEstimate]:
        """Go on without the frames that others wait for: a live caller's patience has ended."""
        return self._estimated(self._observer.wait_no_longer())

    def flush(self) -> list[BodyEstimate]:
        """Wait for nothing more: the streams have ended."""
        estimates = self._estimated(self._observer.flush())
        return estimates + self._told(self._estimation.flush(self._observer.newest_ns))

    def predict(self, stamp_ns: int) -> BodyEstimate | None:
        """The pose at an instant that no frame has come of yet; changes nothing.

        Args:
            stamp_ns: The instant [ns], on the reference sensor's clock.

        Returns:
            None while there is no pose, or none any more.
        """
        block = self.predict_block(stamp_ns)
        return None if block is None else block[0]

    def predict_block(self, stamp_ns: int) -> EstimateBlock | None:
        """The same as a block of one."""
        self.learn()
        readings = self._observer.readings(stamp_ns)
        return self._estimation.predict(stamp_ns, self._observer.newest_ns, readings)

    def learn(self) -> None:
        """Learn from the last frame, whose estimate has gone out before.

        Otherwise done when the next sample comes: a live caller has it done while it waits. The
        estimates are the same.
        """
        self._observer.learn()

    def _estimated(self, observations: Iterable[Observation]) -> list[BodyEstimate]:
        return [e for seen in observations for e in self._told(self._estimation.take(seen))]

    def _told(self, blocks: Iterable[EstimateBlock]) -> list[BodyEstimate]:
        if self.outlet is None:
            return [estimate for block in blocks for estimate in block]
        for block in blocks:
            self.outlet(block)
        return []
