"""The chain from samples to estimates, the same object live and offline.

Samples of several Kinects are brought into ``map``, used first to measure the body and then handed
to the estimator, with the IMUs' orientations of the same instant. An estimator that wants all
sensors at common instants gets them aligned in time (li2020 (2)); any other gets each sensor's
frame as it comes. What comes out depends on the samples alone, never on a clock.
"""

from collections.abc import Callable, Iterator

from pose_common.counters import Counters
from pose_common.stamps import NS_PER_S
from pose_fusion.body.model import load_body_model
from pose_fusion.body.shape import BodyShape
from pose_fusion.calibration.clocks import (
    Clocks,
    block_on_reference_clock,
    on_reference_clock,
)
from pose_fusion.calibration.extrinsics import Extrinsics
from pose_fusion.fusion.estimates import BodyEstimate
from pose_fusion.fusion.estimators.estimator import Estimator, Observation, TimedPose
from pose_fusion.fusion.estimators.registry import estimator_class
from pose_fusion.fusion.frame_queue import FrameQueue
from pose_fusion.fusion.learning import COUNTERS as LEARNING_COUNTERS
from pose_fusion.fusion.learning import FrameLearner
from pose_fusion.fusion.parameters import FusionParameters
from pose_fusion.fusion.preparing import prepare
from pose_fusion.fusion.seen import SeenFrame, SensorsInMap
from pose_fusion.fusion.telling import body_estimate
from pose_fusion.fusion.waiting import WaitingSamples
from pose_fusion.imu.imu_set import ImuSet
from pose_fusion.imu.mounting import Mountings
from pose_fusion.imu.readings import NO_READINGS, SegmentReadings
from pose_fusion.streams.samples import ImuBlock, ImuSample, SkeletonSample, block_of
from pose_fusion.streams.time_alignment import AlignedFrame, TimeAligner

COUNTERS = (
    "skeletons",
    "skeletons_before_extrinsics",
    "skeletons_of_unknown_sensors",
    "imu_samples",
    "imu_samples_out_of_order",
    "frames",
    "frames_of_imus_alone",
    *LEARNING_COUNTERS,
    "estimates",
)


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
        self._estimator_class = estimator_class(parameters.estimator)
        self._estimator_class.check(parameters)
        is_auto = parameters.body_model == "auto"
        self.model = load_body_model(
            self._estimator_class.BODY_MODEL if is_auto else parameters.body_model
        )
        prepare(self._estimator_class, self.model.name)
        self.extrinsics: Extrinsics | None = None
        self._sensors = SensorsInMap(parameters.sensors, None)
        self.clocks: Clocks = {}
        self.shape: BodyShape | None = None
        self.counters = Counters(*COUNTERS, *self._estimator_class.COUNTERS)
        self.aligner = TimeAligner(
            parameters.sensors,
            max_skew_s=parameters.max_skew,
            max_gap_s=parameters.max_gap,
            max_wait_s=parameters.max_wait,
        )
        self.imus = ImuSet(self.model, parameters.tracker_delay)
        self._learner = FrameLearner(
            self.model,
            parameters,
            self.imus,
            self.counters,
            takes_offsets=not self._estimator_class.NEEDS_ALIGNED_FRAMES,
        )
        self._unlearnt: SeenFrame | None = None
        self.outlet: Callable[[BodyEstimate], None] | None = None
        """Is given every estimate at once, before the next frame is looked at."""
        self._estimator: Estimator | None = None
        self._frames = FrameQueue(
            self.aligner if self._estimator_class.NEEDS_ALIGNED_FRAMES else None
        )
        self._waiting = WaitingSamples()
        if extrinsics is not None:
            self.place_sensors(extrinsics)
        if shape is not None:
            self.use_shape(shape)

    def place_sensors(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on.

        What the last half minute held, since the first sample, is caught up on: the body's measures
        and the IMUs' alignment are learnt from it, for nobody stands still in the neutral pose a
        second time. Estimates of the past are not made.
        """
        self.learn()
        self.use_clocks(extrinsics.clocks)
        self.extrinsics = extrinsics
        self._sensors = SensorsInMap(self.parameters.sensors, extrinsics)
        body = extrinsics.body
        if self.shape is None and body is not None and body.model == self.model.name:
            self.use_shape(body.shape)
        while self._waiting:
            sample = self._waiting.popleft()
            if isinstance(sample, SkeletonSample):
                self._take_skeleton(sample)
                self._catch_up()
                continue
            for _ in self._take_imus(sample):
                self._catch_up()

    def _catch_up(self) -> None:
        ready = self._frames.ready
        while ready and self._is_ready(ready[0].stamp_ns):
            self._unlearnt = self._see(ready.popleft())
            self.learn()

    def use_mountings(self, mountings: Mountings) -> None:
        """Take how these IMUs sit from a calibration, instead of from a neutral pose."""
        self.imus.alignment.use_mountings(mountings)

    def use_clocks(self, clocks: Clocks) -> None:
        """Put stamps right by these clocks from now on; what came before stays where it is."""
        self.clocks = clocks

    @property
    def status(self) -> str:
        """What the chain is doing, for people."""
        if self.extrinsics is None:
            return "waiting for extrinsics"
        return self._learner.status if self._estimator is None else "tracking"

    def add_skeleton(self, sample: SkeletonSample) -> list[BodyEstimate]:
        """Take one person's joints from one sensor; returns the estimates that this completes."""
        self.learn()
        self.counters.add("skeletons")
        if self.extrinsics is None:
            self.counters.add("skeletons_before_extrinsics")
            self._waiting.add(sample)
            return []
        self._take_skeleton(sample)
        return self._release()

    def add_imu(self, samples: ImuSample | ImuBlock) -> list[BodyEstimate]:
        """Take IMUs' orientations; returns the estimates that were waiting for them."""
        self.learn()
        block = block_of(samples) if isinstance(samples, ImuSample) else samples
        self.counters.add("imu_samples", len(block))
        if self.extrinsics is None:
            self._waiting.add(block)
            return []
        return [estimate for _ in self._take_imus(block) for estimate in self._release()]

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return self._frames.holds_frames

    def wait_no_longer(self) -> list[BodyEstimate]:
        """Go on without the frames that others wait for: a live caller's patience has ended."""
        self._frames.let_go()
        return self._release()

    def predict(self, stamp_ns: int) -> BodyEstimate | None:
        """The pose at an instant that no frame has come of yet; changes nothing.

        Args:
            stamp_ns: The instant [ns], on the reference sensor's clock.

        Returns:
            None while there is no pose, or none any more.
        """
        self.learn()
        if self._estimator is None:
            return None
        told = self._estimator.predicted(stamp_ns, self._readings(stamp_ns))
        return None if told is None else self._estimate(told)

    def _readings(self, stamp_ns: int) -> SegmentReadings:
        return self.imus.read(stamp_ns) if self.parameters.use_imus else NO_READINGS

    def flush(self) -> list[BodyEstimate]:
        """Wait for nothing more: the streams have ended."""
        self._frames.flush()
        estimates = self._release(everything=True)
        if self._estimator is not None:
            estimates += self._told(self._estimator.flush())
        self.learn()
        return estimates

    def _take_skeleton(self, sample: SkeletonSample) -> None:
        sample = on_reference_clock(sample, self.clocks)
        if sample.sensor not in self.parameters.sensors or not self._is_placed(sample.sensor):
            self.counters.add("skeletons_of_unknown_sensors")
            return
        self._frames.add_skeleton(sample)

    def _is_placed(self, sensor: str) -> bool:
        return self.extrinsics is not None and sensor in self.extrinsics.T_reference_sensor

    def _take_imus(self, block: ImuBlock) -> Iterator[None]:
        """Take IMUs' samples; stops wherever frames may be ready, once at least."""
        block = block_on_reference_clock(block, self.clocks)
        start = 0
        while start < len(block):
            # While the cameras are silent, the IMUs alone give frames.
            stop = start + self._frames.count_until_alone(block.stamps_ns[start:])
            part = block.rows(slice(start, stop)) if stop - start < len(block) else block
            self.counters.add("imu_samples_out_of_order", self.imus.add(part))
            self.counters.add("frames_of_imus_alone", self._frames.add_imus(part.stamps_ns))
            start = stop
            yield

    def _release(self, everything: bool = False) -> list[BodyEstimate]:
        """Process the frames whose IMU samples have come, or need not be waited for."""
        estimates: list[BodyEstimate] = []
        ready = self._frames.ready
        while ready and (everything or self._is_ready(ready[0].stamp_ns)):
            estimates += self._process(ready.popleft())
        return estimates

    def _is_ready(self, stamp_ns: int) -> bool:
        if not self._estimator_class.NEEDS_ALIGNED_FRAMES:
            return True
        waited_ns = self._frames.newest_ns - stamp_ns
        return waited_ns > self.parameters.imu_wait * NS_PER_S or self.imus.has_reached(stamp_ns)

    def learn(self) -> None:
        """Learn from the last frame, whose estimate has gone out before.

        Otherwise done when the next sample comes: a live caller has it done while it waits. The
        estimates are the same.
        """
        if self._unlearnt is None:
            return
        frame, self._unlearnt = self._unlearnt, None
        shape = self._learner.learn(frame, self.shape)
        if shape is not None:
            self.use_shape(shape)

    def _process(self, frame: AlignedFrame) -> list[BodyEstimate]:
        self.learn()
        self._unlearnt = seen = self._see(frame)
        if self._estimator is None:
            return []
        observation = Observation(
            stamp_ns=seen.stamp_ns,
            positions=seen.positions,
            tracking_state=seen.tracking_state,
            cameras=self._sensors.places,
            offsets=self._learner.offsets,
            readings=self._readings(frame.stamp_ns),
        )
        return self._told(self._estimator.advance(observation))

    def _told(self, poses: list[TimedPose]) -> list[BodyEstimate]:
        self.counters.add("estimates", len(poses))
        estimates = [self._estimate(each) for each in poses]
        if self.outlet is not None:
            for estimate in estimates:
                self.outlet(estimate)
        return estimates

    def _see(self, frame: AlignedFrame) -> SeenFrame:
        self.counters.add("frames")
        return self._sensors.see(frame)

    def use_shape(self, shape: BodyShape) -> None:
        """Track a body of these measures from now on."""
        self.shape = shape
        self._estimator = self._estimator_class(self.model, shape, self.parameters, self.counters)

    def _estimate(self, told: TimedPose) -> BodyEstimate:
        return body_estimate(told, self.model, self.parameters.sensors, self._frames.newest_ns)
