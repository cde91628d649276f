"""The chain from samples to estimates, the same object live and offline.

Samples of several Kinects are brought into ``map``, used first to measure the body and then handed
to the estimator, with the IMUs' orientations of the same instant. An estimator that wants all
sensors at common instants gets them aligned in time (li2020 (2)); any other gets each sensor's
frame as it comes. What comes out depends on the samples alone, never on a clock.
"""

from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pose_common.counters import Counters
from pose_common.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_fusion.body.measuring import BodyMeasuring
from pose_fusion.body.model import load_body_model
from pose_fusion.body.shape import BodyShape
from pose_fusion.body.trunk import heading_axes
from pose_fusion.calibration.clocks import (
    Clocks,
    block_on_reference_clock,
    on_reference_clock,
)
from pose_fusion.calibration.extrinsics import Extrinsics
from pose_fusion.calibration.neutral_stand import NeutralStandWatcher
from pose_fusion.fusion.estimates import BodyEstimate
from pose_fusion.fusion.estimators.estimator import Estimator, FusedPose, Observation, TimedPose
from pose_fusion.fusion.estimators.kinect_tracker import mean_of_sensors
from pose_fusion.fusion.estimators.registry import estimator_class
from pose_fusion.fusion.parameters import FusionParameters
from pose_fusion.fusion.preparing import prepare
from pose_fusion.imu.imu_set import ImuSet
from pose_fusion.imu.mounting import Mountings
from pose_fusion.streams.frame_order import FrameOrder
from pose_fusion.streams.samples import FloatArray, ImuBlock, ImuSample, SkeletonSample, block_of
from pose_fusion.streams.time_alignment import JUMP_BACK_NS, AlignedFrame, TimeAligner

NS_PER_S = 1_000_000_000
LONGEST_WAIT_NS = 30 * NS_PER_S  # what came earlier, before the extrinsics, is forgotten
CAMERAS_SILENT_NS = NS_PER_S // 20  # after which the IMUs alone give a frame
LONGEST_LAG_NS = NS_PER_S // 2  # by which cameras may usually be behind the IMUs
LAGS = 9  # [frames] of which the least is what is usual
LATEST_NS = NS_PER_S // 20  # sensors that are this far apart still show the same pose
COUNTERS = (
    "skeletons",
    "skeletons_before_extrinsics",
    "skeletons_of_unknown_sensors",
    "imu_samples",
    "imu_samples_out_of_order",
    "frames",
    "frames_of_imus_alone",
    "frames_measuring_the_body",
    "neutral_stands",
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
        self._neutral_watcher: NeutralStandWatcher | None = NeutralStandWatcher(self.model)
        self._offsets = np.zeros((len(parameters.sensors), len(JOINTS), 3))
        self._latest = np.full((len(parameters.sensors), len(JOINTS), 3), np.nan)
        self._latest_ns = [0] * len(parameters.sensors)
        self._measuring = BodyMeasuring(self.model, parameters.shape_duration)
        self._estimator: Estimator | None = None
        self._pending: deque[AlignedFrame] = deque()
        self._order: FrameOrder[AlignedFrame] = FrameOrder()
        self._waiting: deque[SkeletonSample | ImuBlock] = deque()
        self._newest_ns = 0
        self._newest_frame_ns = 0
        self._newest_seen_ns = 0  # by a camera
        self._newest_imu_ns = 0
        self._lags_ns: deque[int] = deque(maxlen=LAGS)
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
        self.use_clocks(extrinsics.clocks)
        self.extrinsics = extrinsics
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
        while self._pending and self._is_ready(self._pending[0].stamp_ns):
            self._learn(self._pending.popleft())

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
        return self._measuring.status if self._estimator is None else "tracking"

    def add_skeleton(self, sample: SkeletonSample) -> list[BodyEstimate]:
        """Take one person's joints from one sensor; returns the estimates that this completes."""
        self.counters.add("skeletons")
        if self.extrinsics is None:
            self.counters.add("skeletons_before_extrinsics")
            self._wait(sample)
            return []
        self._take_skeleton(sample)
        return self._release()

    def add_imu(self, samples: ImuSample | ImuBlock) -> list[BodyEstimate]:
        """Take IMUs' orientations; returns the estimates that were waiting for them."""
        block = block_of(samples) if isinstance(samples, ImuSample) else samples
        self.counters.add("imu_samples", len(block))
        if self.extrinsics is None:
            self._wait(block)
            return []
        return [estimate for _ in self._take_imus(block) for estimate in self._release()]

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return self._order.holds

    def wait_no_longer(self) -> list[BodyEstimate]:
        """Go on without the frames that others wait for: a live caller's patience has ended."""
        self._let_go()
        return self._release()

    def predict(self, stamp_ns: int) -> BodyEstimate | None:
        """The pose at an instant that no frame has come of yet; changes nothing.

        Args:
            stamp_ns: The instant [ns], on the reference sensor's clock.

        Returns:
            None while there is no pose, or none any more.
        """
        if self._estimator is None:
            return None
        readings = self.imus.read(stamp_ns) if self.parameters.use_imus else {}
        told = self._estimator.predicted(stamp_ns, readings)
        return None if told is None else self._estimate(stamp_ns, told.pose, told.tracking_state)

    def flush(self) -> list[BodyEstimate]:
        """Wait for nothing more: the streams have ended."""
        self._let_go()
        self._pending.extend(self.aligner.flush())
        estimates = self._release(everything=True)
        if self._estimator is not None:
            estimates += self._told(self._estimator.flush())
        return estimates

    def _let_go(self) -> None:
        for frame in self._order.flush():
            self._await(frame)

    def _wait(self, sample: SkeletonSample | ImuBlock) -> None:
        """Keep a sample until the sensors' places are known."""
        self._waiting.append(sample)
        while abs(_stamp_ns(sample) - _stamp_ns(self._waiting[0])) > LONGEST_WAIT_NS:
            self._waiting.popleft()

    def _take_skeleton(self, sample: SkeletonSample) -> None:
        sample = on_reference_clock(sample, self.clocks)
        if sample.sensor not in self.parameters.sensors or not self._is_placed(sample.sensor):
            self.counters.add("skeletons_of_unknown_sensors")
            return
        if self._estimator_class.NEEDS_ALIGNED_FRAMES:
            self._note_time(sample.stamp_ns)
            self._pending.extend(self.aligner.add(sample))
            return
        self._note_time(sample.stamp_ns)
        self._note_seen(sample.stamp_ns)
        frame = AlignedFrame(stamp_ns=sample.stamp_ns, samples={sample.sensor: sample})
        for ready in self._order.add(sample.sensor, sample.stamp_ns, frame):
            self._await(ready)

    def _is_placed(self, sensor: str) -> bool:
        return self.extrinsics is not None and sensor in self.extrinsics.T_reference_sensor

    def _take_imus(self, block: ImuBlock) -> Iterator[None]:
        """Take IMUs' samples; stops wherever frames may be ready, once at least."""
        block = block_on_reference_clock(block, self.clocks)
        start = 0
        while start < len(block):
            # While the cameras are silent, the IMUs alone give frames.
            is_late = block.stamps_ns[start:] > self._cameras_silent_ns()
            is_alone = bool(is_late.any()) and not self._estimator_class.NEEDS_ALIGNED_FRAMES
            stop = start + int(is_late.argmax()) + 1 if is_alone else len(block)
            part = block.rows(slice(start, stop)) if stop - start < len(block) else block
            self.counters.add("imu_samples_out_of_order", self.imus.add(part))
            self._newest_imu_ns = int(part.stamps_ns.max())
            self._note_time(self._newest_imu_ns)
            if is_alone:
                self._let_go()
                self._go_on_alone(int(part.stamps_ns[-1]))
            start = stop
            yield

    def _note_seen(self, stamp_ns: int) -> None:
        """A camera's frame has come."""
        self._lags_ns.append(max(self._newest_imu_ns - stamp_ns, 0))
        is_set_back = stamp_ns < self._newest_seen_ns - JUMP_BACK_NS
        self._newest_seen_ns = stamp_ns if is_set_back else max(self._newest_seen_ns, stamp_ns)

    def _usual_lag_ns(self) -> int:
        """How far the cameras usually are behind the IMUs: no silence yet."""
        return min(*self._lags_ns, LONGEST_LAG_NS) if self._lags_ns else 0

    def _cameras_silent_ns(self) -> int:
        """The instant from which on the IMUs alone give the next frame."""
        seen_ns = self._newest_seen_ns + self._usual_lag_ns()
        return max(seen_ns, self._newest_frame_ns) + CAMERAS_SILENT_NS

    def _go_on_alone(self, stamp_ns: int) -> None:
        """Frames of the IMUs alone up to an instant, from where waiting for cameras ended."""
        first_ns = max(self._newest_frame_ns + CAMERAS_SILENT_NS, stamp_ns - self._usual_lag_ns())
        between = range(first_ns, stamp_ns - CAMERAS_SILENT_NS // 2, CAMERAS_SILENT_NS)
        for instant_ns in (*between, stamp_ns):
            self.counters.add("frames_of_imus_alone")
            self._await(AlignedFrame(stamp_ns=instant_ns, samples={}))

    def _await(self, frame: AlignedFrame) -> None:
        """Put a frame, of one sensor or of none, into the queue."""
        self._newest_frame_ns = frame.stamp_ns
        self._pending.append(frame)

    def _note_time(self, stamp_ns: int) -> None:
        is_set_back = stamp_ns < self._newest_ns - JUMP_BACK_NS  # a recording that loops
        self._newest_ns = stamp_ns if is_set_back else max(self._newest_ns, stamp_ns)

    def _release(self, everything: bool = False) -> list[BodyEstimate]:
        """Process the frames whose IMU samples have come, or need not be waited for."""
        estimates: list[BodyEstimate] = []
        while self._pending and (everything or self._is_ready(self._pending[0].stamp_ns)):
            estimates += self._process(self._pending.popleft())
        return estimates

    def _is_ready(self, stamp_ns: int) -> bool:
        if not self._estimator_class.NEEDS_ALIGNED_FRAMES:
            return True
        waited_ns = self._newest_ns - stamp_ns
        return waited_ns > self.parameters.imu_wait * NS_PER_S or self.imus.has_reached(stamp_ns)

    def _learn(self, frame: AlignedFrame) -> tuple[FloatArray, NDArray[np.uint8]]:
        """Take from a frame what it tells of the body's measures and of the IMUs' alignment.

        Returns:
            Every sensor's joints in map, shape (sensors, 15, 3) [m], and their states.
        """
        self.counters.add("frames")
        measured, state = self._in_map(frame)
        if self.parameters.use_imus:
            tracked = (state == TrackingState.TRACKED)[..., None]
            self._keep_latest(frame, np.where(tracked, measured, np.nan))
            self.imus.observe(frame.stamp_ns, self._seen_now())
        self._watch_for_neutral(frame.stamp_ns, measured, state)
        if self.shape is None:
            self.counters.add("frames_measuring_the_body")
            shape = self._measuring.add(frame.stamp_ns, measured, state)
            if shape is not None:
                self.use_shape(shape)
        return measured, state

    def _seen_now(self) -> FloatArray:
        """Mean of the sensors' tracked joints, without their trackers' offsets, (15, 3) [m]."""
        R_map_heading = heading_axes(mean_of_sensors(self._latest))
        if np.isnan(R_map_heading[0, 0]):
            return mean_of_sensors(self._latest)
        return mean_of_sensors(self._latest - self._offsets @ R_map_heading.T)

    def _keep_latest(self, frame: AlignedFrame, tracked: FloatArray) -> None:
        """Remember what each sensor saw last, a short while ago at most."""
        for index, sensor in enumerate(self.parameters.sensors):
            if sensor in frame.samples:
                self._latest[index], self._latest_ns[index] = tracked[index], frame.stamp_ns
            elif abs(frame.stamp_ns - self._latest_ns[index]) > LATEST_NS:
                self._latest[index] = np.nan

    def _watch_for_neutral(
        self, stamp_ns: int, measured: FloatArray, state: NDArray[np.uint8]
    ) -> None:
        """Take the trackers' offsets, and measures if there are none, from a neutral stand."""
        if self._neutral_watcher is None or self._estimator_class.NEEDS_ALIGNED_FRAMES:
            return
        stand = self._neutral_watcher.add(stamp_ns, measured, state, self.shape)
        if stand is None:
            return
        self._neutral_watcher = None
        self._offsets = stand.offsets
        self.counters.add("neutral_stands")
        if self.shape is None:
            self.use_shape(stand.shape)

    def _process(self, frame: AlignedFrame) -> list[BodyEstimate]:
        estimator = self._estimator
        measured, state = self._learn(frame)
        if estimator is None or self.extrinsics is None:
            return []
        observation = Observation(
            stamp_ns=frame.stamp_ns,
            positions=measured,
            tracking_state=state,
            cameras=np.stack(
                [self.extrinsics.T_map_sensor(s)[:3, 3] for s in self.parameters.sensors]
            ),
            offsets=self._offsets,
            readings=self.imus.read(frame.stamp_ns) if self.parameters.use_imus else {},
        )
        return self._told(estimator.advance(observation))

    def _told(self, poses: list[TimedPose]) -> list[BodyEstimate]:
        self.counters.add("estimates", len(poses))
        return [self._estimate(each.stamp_ns, each.pose, each.tracking_state) for each in poses]

    def _in_map(self, frame: AlignedFrame) -> tuple[FloatArray, NDArray[np.uint8]]:
        """Every sensor's joints in map, shape (sensors, 15, 3) [m], and their states."""
        sensors = self.parameters.sensors
        measured = np.full((len(sensors), len(JOINTS), 3), np.nan)
        state = np.zeros((len(sensors), len(JOINTS)), np.uint8)
        for index, sensor in enumerate(sensors):
            sample = frame.samples.get(sensor)
            if sample is None or self.extrinsics is None:
                continue
            T_map_sensor = self.extrinsics.T_map_sensor(sensor)
            measured[index] = sample.positions @ T_map_sensor[:3, :3].T + T_map_sensor[:3, 3]
            state[index] = np.where(np.isfinite(measured[index, :, 0]), sample.tracking_state, 0)
        return measured, state

    def use_shape(self, shape: BodyShape) -> None:
        """Track a body of these measures from now on."""
        self.shape = shape
        self._estimator = self._estimator_class(self.model, shape, self.parameters, self.counters)

    def _estimate(
        self,
        stamp_ns: int,
        fused: FusedPose,
        tracking_state: NDArray[np.uint8],
    ) -> BodyEstimate:
        transforms = {}
        for index, link in enumerate(self.model.links.values()):
            T_map_link = np.eye(4)
            T_map_link[:3, :3] = fused.rotations[index]
            T_map_link[:3, 3] = (
                fused.position[:3] if link.joint is None else fused.joints[JOINT_INDEX[link.joint]]
            )
            transforms[link.name] = T_map_link
        return BodyEstimate(
            stamp_ns=stamp_ns,
            newest_ns=self._newest_ns,
            dof_names=self.model.dof_names,
            position=fused.position,
            velocity=fused.velocity,
            position_stddev=np.sqrt(fused.variance),
            weight_kinect=fused.weight_kinect,
            weight_imu=fused.weight_imu,
            source=fused.source,
            joints=fused.joints,
            tracking_state=tracking_state,
            T_map_link=transforms,
            sensor_weight=dict(zip(self.parameters.sensors, fused.sensor_weight, strict=True)),
        )


def _stamp_ns(sample: SkeletonSample | ImuBlock) -> int:
    return sample.stamp_ns if isinstance(sample, SkeletonSample) else int(sample.stamps_ns[-1])
