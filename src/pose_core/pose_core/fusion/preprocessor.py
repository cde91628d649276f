"""First part of the pipeline: from samples to observations.

Only two things come back from the estimator: the delays of the trackers, and whose IMU's reference
frame is turned over.
"""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from pose_core.body.measurement import BodyMeasurement
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimates.observation import Observation
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.registry import estimator_class
from pose_core.fusion import sample_buffer
from pose_core.fusion.frame_queue import FrameQueue
from pose_core.fusion.sample_buffer import SampleBuffer
from pose_core.fusion.sensor_frames import SensorsInMap
from pose_core.imu.imu_history import NO_MEASUREMENTS, ImuMeasurements
from pose_core.imu.imu_set import ImuSet
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.clocks import Clocks, block_on_reference_clock, on_reference_clock
from pose_core.streams.held_joints import HeldJoints
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample, block_of
from pose_core.streams.time_alignment import AlignedFrame, TimeAligner
from pose_core.streams.tracked_joints import TrackedJoints

COUNTERS = (
    "skeletons",
    "skeletons_before_extrinsics",
    *sample_buffer.COUNTERS,
    "skeletons_of_unknown_sensors",
    "joints_held",
    "imu_samples",
    "imu_samples_out_of_order",
    "imu_samples_without_orientation",
    "frames",
    "frames_of_imus_alone",
    "frames_measuring_the_body",
)


TRACKED_JOINTS_EVERY = 7  # [-] skeletons, of which one is counted; up to six cameras take turns


class Preprocessor:
    """Transforms the sensors' samples to ``map``, orders them and measures the body.

    Args:
        model: The body model.
        parameters: See :class:`PipelineParameters`.
        counters: Declares :data:`COUNTERS`.
        is_live: See :class:`pose_core.fusion.pipeline.Pipeline`.
    """

    def __init__(
        self,
        model: BodyModel,
        parameters: PipelineParameters,
        counters: Counters,
        *,
        is_live: bool = False,
    ) -> None:
        kind = estimator_class(parameters.estimator)
        self._uses_imus = parameters.use_imus and kind.USES_IMUS
        self.model = model
        self.parameters = parameters
        self.counters = counters
        self.extrinsics: Extrinsics | None = None
        self.clocks: Clocks = {}
        self.tracker_delays_ns: Mapping[str, int] = {}
        """Delay of each sensor's tracker [ns], subtracted from its stamps."""
        self.shape: BodyShape | None = None
        """The person's body measures, once they are known."""
        self.aligner = TimeAligner(parameters.sensors)
        self.imus = ImuSet()
        self.held_joints = HeldJoints()
        self.tracked_joints = TrackedJoints()
        self._sensors = SensorsInMap(parameters.sensors, None)
        self._measurement = BodyMeasurement(model, parameters.shape_duration)
        self.frames = FrameQueue(
            self.aligner if kind.NEEDS_ALIGNED_FRAMES else None, is_live=is_live
        )
        self._waiting: SampleBuffer[SkeletonSample] = SampleBuffer(counters)

    def use_extrinsics(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on.

        The body is measured from the samples of the last half minute. Past instants are not
        observed again.
        """
        self.clocks = extrinsics.clocks
        self.extrinsics = extrinsics
        self._sensors = SensorsInMap(self.parameters.sensors, extrinsics)
        body = extrinsics.body
        if self.shape is None and body is not None and body.model == self.model.name:
            self.shape = body.shape
        while self._waiting:
            for frame in self._frames_of(self._waiting.popleft()):
                if self.shape is None:
                    self._measure(frame)
        if self.shape is None:
            self.shape = self._measurement.shape()

    @property
    def status(self) -> str:
        """State of the pipeline, as human-readable text."""
        if self.extrinsics is None:
            return "waiting for extrinsics"
        return self._measurement.status if self.shape is None else "tracking"

    def add(self, samples: SkeletonSample | ImuSample | ImuBlock) -> Iterator[Observation]:
        """Add one person's joints from one sensor, or IMU samples.

        Yields:
            The observations that are now complete. The caller must exhaust the iterator before it
            adds anything else.
        """
        if isinstance(samples, SkeletonSample):
            return self._add_skeleton(samples)
        return self._add_imu(block_of(samples) if isinstance(samples, ImuSample) else samples)

    def _add_skeleton(self, sample: SkeletonSample) -> Iterator[Observation]:
        self.counters.add("skeletons")
        if self.extrinsics is None:
            self.counters.add("skeletons_before_extrinsics")
            self._waiting.add(sample)
            return
        if self.counters["skeletons"] % TRACKED_JOINTS_EVERY == 0:
            self.tracked_joints.add(sample.tracking_state)
        sample = self.held_joints.checked(sample)
        self.counters.add("joints_held", len(self.held_joints.held[sample.sensor]))
        yield from self._observations(self._frames_of(sample))

    def _add_imu(self, block: ImuBlock) -> Iterator[Observation]:
        self.counters.add("imu_samples", len(block))
        is_finite = np.isfinite(block.orientation)
        if not is_finite.all():
            known = is_finite.all(axis=1)
            self.counters.add("imu_samples_without_orientation", int((~known).sum()))
            block = block.rows(np.flatnonzero(known))
        if not self._uses_imus:  # stored, to be named as unused
            self.imus.add(block_on_reference_clock(block, self.clocks))
            return
        if self.extrinsics is None:
            self._waiting.add(block)
            return
        yield from self._observations(self._frames_of(block))

    def release_held(self) -> Iterator[Observation]:
        """Process frames that wait for earlier ones: a live caller waits no longer."""
        self.frames.release_all()
        return self._observations(self._ready_frames())

    def flush(self) -> Iterator[Observation]:
        """Process everything that is left, after the end of the streams."""
        self.frames.flush()
        return self._observations(self._ready_frames())

    def imus_at(self, stamp_ns: int) -> ImuMeasurements:
        """The IMUs' states at an instant [ns]."""
        return self.imus.read(stamp_ns) if self._uses_imus else NO_MEASUREMENTS

    def _take_skeleton(self, sample: SkeletonSample) -> None:
        placed = () if self.extrinsics is None else self.extrinsics.sensors
        if sample.sensor not in self.parameters.sensors or sample.sensor not in placed:
            self.counters.add("skeletons_of_unknown_sensors")
            return
        delay_ns = self.tracker_delays_ns.get(sample.sensor, 0)
        self.frames.add_skeleton(on_reference_clock(sample, self.clocks, delay_ns))

    def _imu_parts(self, block: ImuBlock) -> Iterator[ImuBlock]:
        """Samples on the reference clock, divided where they give a frame by themselves.

        While the cameras are silent, the IMUs give frames. The caller takes each part before it
        requests the next one.
        """
        block = block_on_reference_clock(block, self.clocks)
        start = 0
        while start < len(block):
            stop = start + self.frames.count_until_alone(block.stamps_ns[start:])
            yield block.rows(slice(start, stop)) if stop - start < len(block) else block
            start = stop

    def _frames_of(self, samples: SkeletonSample | ImuBlock) -> Iterator[AlignedFrame]:
        """Take samples, part by part; yield the frames that each part makes ready."""
        if isinstance(samples, SkeletonSample):
            self._take_skeleton(samples)
            yield from self._ready_frames()
        else:
            for part in self._imu_parts(samples):
                self.counters.add("imu_samples_out_of_order", self.imus.add(part))
                self.counters.add("frames_of_imus_alone", self.frames.add_imus(part.stamps_ns))
                yield from self._ready_frames()

    def _observations(self, frames: Iterable[AlignedFrame]) -> Iterator[Observation]:
        """Observations of frames; none of those that measure the body."""
        for frame in frames:
            if self.shape is None:
                self._measure(frame)
                self.shape = self._measurement.shape()
            else:
                yield self._observation(frame, self.shape)

    def _ready_frames(self) -> Iterator[AlignedFrame]:
        """Frames that no earlier one is waited for."""
        while self.frames.ready:
            self.counters.add("frames")
            yield self.frames.ready.popleft()

    def _measure(self, frame: AlignedFrame) -> None:
        self.counters.add("frames_measuring_the_body")
        self._measurement.add(frame.stamp_ns, *self._sensors.transform(frame))

    def _observation(self, frame: AlignedFrame, shape: BodyShape) -> Observation:
        positions, tracking_state = self._sensors.transform(frame)
        return Observation(
            stamp_ns=frame.stamp_ns,
            newest_ns=self.frames.newest_ns,
            shape=shape,
            positions=positions,
            tracking_state=tracking_state,
            cameras=self._sensors.places,
            imus=self.imus_at(frame.stamp_ns),
        )
