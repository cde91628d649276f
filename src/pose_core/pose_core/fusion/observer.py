"""The chain's first half: from samples to observations.

Nothing that an estimator finds comes back here: the two halves may run beside each other.
"""

from collections.abc import Iterator

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.registry import estimator_class
from pose_core.fusion.frame_queue import FrameQueue
from pose_core.fusion.learning import COUNTERS as LEARNING_COUNTERS
from pose_core.fusion.learning import FrameLearner
from pose_core.fusion.observation_block import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.seen import SeenFrame, SensorsInMap
from pose_core.fusion.waiting import WaitingSamples
from pose_core.imu.imu_set import ImuSet
from pose_core.imu.mounting import Mountings
from pose_core.imu.readings import NO_READINGS, SegmentReadings
from pose_core.session.clocks import (
    Clocks,
    block_on_reference_clock,
    on_reference_clock,
)
from pose_core.session.extrinsics import Extrinsics
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample, block_of
from pose_core.streams.time_alignment import AlignedFrame, TimeAligner

COUNTERS = (
    "skeletons",
    "skeletons_before_extrinsics",
    "skeletons_of_unknown_sensors",
    "imu_samples",
    "imu_samples_out_of_order",
    "frames",
    "frames_of_imus_alone",
    *LEARNING_COUNTERS,
)


class Observer:
    """Brings the sensors' samples into ``map``, in order, and learns from them beside the pose.

    Observations come out one by one: what a frame teaches is learnt when the next is asked for, so
    that whoever takes an observation first may tell its estimate first.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
        counters: Declares :data:`COUNTERS`.
    """

    def __init__(self, model: BodyModel, parameters: FusionParameters, counters: Counters) -> None:
        kind = estimator_class(parameters.estimator)
        self._needs_aligned_frames = kind.NEEDS_ALIGNED_FRAMES
        self.model = model
        self.parameters = parameters
        self.counters = counters
        self.extrinsics: Extrinsics | None = None
        self.clocks: Clocks = {}
        self.shape: BodyShape | None = None
        """The person's measures, once they are known."""
        self.aligner = TimeAligner(
            parameters.sensors,
            max_skew_s=parameters.max_skew,
            max_gap_s=parameters.max_gap,
            max_wait_s=parameters.max_wait,
        )
        self.imus = ImuSet(model, parameters.tracker_delay)
        self._sensors = SensorsInMap(parameters.sensors, None)
        self._learner = FrameLearner(
            model,
            parameters,
            self.imus,
            counters,
            takes_offsets=not self._needs_aligned_frames,
        )
        self._unlearnt: SeenFrame | None = None
        self._frames = FrameQueue(self.aligner if self._needs_aligned_frames else None)
        self._waiting = WaitingSamples()

    def place_sensors(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on.

        What the last half minute held, since the first sample, is caught up on: the body's measures
        and the IMUs' alignment are learnt from it, for nobody stands still in the neutral pose a
        second time. Observations of the past are not made.
        """
        self.learn()
        self.clocks = extrinsics.clocks
        self.extrinsics = extrinsics
        self._sensors = SensorsInMap(self.parameters.sensors, extrinsics)
        body = extrinsics.body
        if self.shape is None and body is not None and body.model == self.model.name:
            self.shape = body.shape
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

    @property
    def status(self) -> str:
        """What the chain is doing, for people."""
        if self.extrinsics is None:
            return "waiting for extrinsics"
        return self._learner.status if self.shape is None else "tracking"

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest sample of any source [ns]."""
        return self._frames.newest_ns

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return self._frames.holds_frames

    def add(self, samples: SkeletonSample | ImuSample | ImuBlock) -> Iterator[Observation]:
        """Take one person's joints from one sensor, or IMUs' orientations.

        Yields:
            The observations that these complete. They are to be taken before anything else is
            added.
        """
        if isinstance(samples, SkeletonSample):
            return self._add_skeleton(samples)
        return self._add_imu(block_of(samples) if isinstance(samples, ImuSample) else samples)

    def _add_skeleton(self, sample: SkeletonSample) -> Iterator[Observation]:
        self.learn()
        self.counters.add("skeletons")
        if self.extrinsics is None:
            self.counters.add("skeletons_before_extrinsics")
            self._waiting.add(sample)
            return
        self._take_skeleton(sample)
        yield from self._release()

    def _add_imu(self, block: ImuBlock) -> Iterator[Observation]:
        self.learn()
        self.counters.add("imu_samples", len(block))
        if self.extrinsics is None:
            self._waiting.add(block)
            return
        for _ in self._take_imus(block):
            yield from self._release()

    def wait_no_longer(self) -> Iterator[Observation]:
        """Go on without the frames that others wait for: a live caller's patience has ended."""
        self._frames.let_go()
        yield from self._release()

    def flush(self) -> Iterator[Observation]:
        """Wait for nothing more: the streams have ended."""
        self._frames.flush()
        yield from self._release(everything=True)
        self.learn()

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
            self.shape = shape

    def readings(self, stamp_ns: int) -> SegmentReadings:
        """What the aligned IMUs say of an instant [ns]."""
        return self.imus.read(stamp_ns) if self.parameters.use_imus else NO_READINGS

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

    def _release(self, everything: bool = False) -> Iterator[Observation]:
        """Look at the frames whose IMU samples have come, or need not be waited for."""
        ready = self._frames.ready
        while ready and (everything or self._is_ready(ready[0].stamp_ns)):
            self.learn()
            self._unlearnt = seen = self._see(ready.popleft())
            if self.shape is not None:
                yield self._observation(seen, self.shape)

    def _is_ready(self, stamp_ns: int) -> bool:
        if not self._needs_aligned_frames:
            return True
        waited_ns = self._frames.newest_ns - stamp_ns
        return waited_ns > self.parameters.imu_wait * NS_PER_S or self.imus.has_reached(stamp_ns)

    def _see(self, frame: AlignedFrame) -> SeenFrame:
        self.counters.add("frames")
        return self._sensors.see(frame)

    def _observation(self, seen: SeenFrame, shape: BodyShape) -> Observation:
        return Observation(
            stamp_ns=seen.stamp_ns,
            newest_ns=self._frames.newest_ns,
            shape=shape,
            positions=seen.positions,
            tracking_state=seen.tracking_state,
            cameras=self._sensors.places,
            offsets=self._learner.offsets,
            readings=self.readings(seen.stamp_ns),
        )
