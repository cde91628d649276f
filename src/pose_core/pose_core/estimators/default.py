"""``default``: the filter of :mod:`pose_core.filter`, updated with each sensor's frame."""

from collections.abc import Sequence
from math import isnan
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape, with_shorter_arms
from pose_core.counters import Counters
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import TimedPose
from pose_core.estimators.estimator import StepwiseEstimator
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.variance_scale import CONSISTENT_NIS, updated_mean_nis, variance_scale
from pose_core.filter.crossed_limbs_check import CrossedLimbsCheck
from pose_core.filter.depth_errors import depth_variance_scale
from pose_core.filter.error_state_filter import ErrorStateFilter
from pose_core.filter.facing_check import FacingCheck
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import NO_IMUS, ImuFrame
from pose_core.filter.imu_alignments import ImuAlignments
from pose_core.filter.restart_cause import RestartCause
from pose_core.filter.start_frames import StartFrames
from pose_core.filter.state import CAMERA_TIMEOUT_S, FilterState
from pose_core.filter.step import StepResult
from pose_core.filter.step_history import KeptStep, StepHistory
from pose_core.filter.tracker_errors import MAX_STEP_S
from pose_core.filter.tuning import FilterTuning
from pose_core.finite_numbers import nan_mean
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.joints import TrackingState
from pose_core.kernels.published_state import CAMERAS, IMUS, PublishedState
from pose_core.stamps import JUMP_BACK_NS, NS_PER_S

SAME_INSTANT_S = 0.005  # [s] by which a frame may be late and be used as if it were not
UNKEPT_S = 0.03  # [s] the same while the steps since are not kept, as before the first late frame
MAX_LEAD_S = 0.1  # [s] by which a frame's stamp may be ahead of the host's clock
SILENT_S = 0.2  # [s] after its last frame, a camera is no source of the published pose
MAX_BRIDGED_S = 5.0  # [s] silence of all sensors after which aligned IMUs do not go on
JUMP_BACK_S = JUMP_BACK_NS / NS_PER_S
DIVERGED_SHARE = 0.5  # [-] of joints far from their prediction: the person is lost
DIVERGED_NS = 250_000_000  # [ns] after which it is restarted


class DefaultEstimator(StepwiseEstimator):
    """Predicts to each observation and updates with the IMUs' samples and the cameras' frames."""

    COUNTERS: ClassVar[tuple[str, ...]] = (
        "filter_starts",
        *(cause.value for cause in RestartCause),
        "frames_without_trunk",
        "frames_too_late",
        "frames_late_but_used",
        "limbs_turned_back",
        "sides_swapped",
    )
    BODY_MODEL = "default"
    NEEDS_ALIGNED_FRAMES = False
    CAN_PREDICT = True
    USES_IMUS = True
    ALIGNS_IMUS = True

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        parameters: PipelineParameters,
        counters: Counters,
        tuning: FilterTuning | None = None,
    ) -> None:
        sensors = len(parameters.sensors)
        self.tuning = (tuning or FilterTuning()).for_cameras(sensors)
        shape = with_shorter_arms(shape, self.tuning.arm_length)
        super().__init__(model, shape, parameters, counters)
        self._filter = ErrorStateFilter(
            model, shape, sensors, self.tuning, parameters.tracker_delay
        )
        self._alignments = ImuAlignments(model, self.tuning)
        self._facing = FacingCheck()
        self._crossed = CrossedLimbsCheck()
        self._start_frames = StartFrames(sensors)
        self._history = StepHistory(self._filter)
        self._diverged_since_ns: int | None = None
        self._mean_nis = CONSISTENT_NIS
        self._information = self._no_information()  # of the last update with each source

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """State of use of each IMU with samples."""
        return self._alignments.uses

    @property
    def tracker_delays_s(self) -> FloatArray | None:
        """Delay of each sensor's tracker, (sensors,) [s]; without IMUs, the parameter's value."""
        return self._filter.delays_s

    @property
    def z_down_imus(self) -> frozenset[str]:
        """Segments whose IMU's reference frame has a z axis that points down (NED)."""
        return self._alignments.z_down

    @property
    def measured_delays_s(self) -> FloatArray | None:
        """Measured delay of each tracker and its deviation, (2, sensors) [s]."""
        return self._filter.measured_delays_s

    @property
    def views_apart_m(self) -> FloatArray | None:
        """Distance of each camera's view from the estimate, (sensors,) [m]; None if unknown."""
        state = self._filter.state
        if state is None:
            return None
        sends = state.views.silent_s < CAMERA_TIMEOUT_S
        return np.where(sends, np.linalg.norm(state.views.apart, axis=1), 0.0)

    @property
    def sensor_to_segment(self) -> SensorsToSegments:
        """Sensor-to-segment rotations of the aligned IMUs, as estimated by the filter."""
        state = self._filter.state
        return {} if state is None else self._alignments.sensor_to_segment(state)

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use sensor-to-segment rotations of a calibration; see :class:`ImuAlignments`."""
        self._alignments.use_sensor_to_segment(alignments)

    def advance(self, observation: Observation) -> None:
        """Run one filter step."""
        self._step(observation)

    def update(self, observation: Observation) -> PublishedState | None:
        """Run one filter step; None while there is no pose, and for late frames."""
        information = self._step(observation)
        if information is None or self._filter.state is None:
            return None
        return self._published(self._filter.state, information)

    def _step(self, observation: Observation) -> FloatArray | None:
        """Run one filter step; the information of its update, None if there is no pose."""
        ahead_s = (observation.stamp_ns - self._history.stamp_ns) / NS_PER_S
        self._start_frames.add(observation)
        is_late = self._filter.state is not None and -JUMP_BACK_S < ahead_s < 0.0
        later: Sequence[KeptStep] = ()
        predicted_from = self._filter.predicted_from
        if is_late and ahead_s < -SAME_INSTANT_S:
            later = self._history.go_back(observation.stamp_ns)
            if not later and ahead_s < -UNKEPT_S:
                self.counters.add("frames_too_late")
                return None
        if not self._predict_or_start(observation):
            return None
        information, alignments_before = self._no_information(), self._alignments.changes
        result = self._update_filter(observation, is_late, information)
        if result is None:
            return None
        if self._has_diverged(observation, result) and not self._start(
            observation, RestartCause.DIVERGED
        ):
            return None
        if is_late:
            if self._alignments.changes == alignments_before:  # otherwise it has restarted
                self._repeat(later)
            self._filter.predicted_from = predicted_from  # what is interpolated from
            self.counters.add("frames_late_but_used")
            return None
        since_s = max(min(ahead_s, 1.0), 0.0)
        self._mean_nis = updated_mean_nis(self._mean_nis, since_s, result.mean_nis)
        return information

    def predicted(self, stamp_ns: int, imus: ImuMeasurements) -> TimedPose | None:
        """Predict the state to an instant; links with an aligned IMU follow its samples."""
        ahead_s = (stamp_ns - self._history.stamp_ns) / NS_PER_S
        state = self._filter.state
        if state is None or not -MAX_LEAD_S <= ahead_s < self.parameters.forget_after:
            return None
        ahead_s = max(ahead_s, 0.0)
        aligned = self._alignments.frame(imus)
        information = self._last_information(state, ahead_s, aligned.links)
        pose = self._published(state, information, ahead_s, aligned)
        return TimedPose(stamp_ns=stamp_ns, pose=pose)

    @property
    def stamp_ns(self) -> int | None:
        """Instant of the state [ns]; None if there is none."""
        return None if self._filter.state is None else self._history.stamp_ns

    def interpolated(self, stamps_ns: Sequence[int]) -> PublishedState | None:
        """States at instants between the last two observations."""
        state = self._filter.state
        if state is None or not stamps_ns:
            return None
        ages_s = (self._history.stamp_ns - np.array(stamps_ns)) / NS_PER_S
        information = self._last_information(state, 0.0, state.imus.is_used)
        return self._filter.interpolated(ages_s, information, self._variance_scale(state))

    def _last_information(
        self, state: FilterState, ahead_s: float, links: NDArray[np.int64] | NDArray[np.bool_]
    ) -> FloatArray:
        """Information of the last updates: cameras that still send, IMUs of these links."""
        information = self._no_information()
        if min(state.views.silent_s.tolist()) + ahead_s < SILENT_S:
            information[CAMERAS] = self._information[CAMERAS]
        information[IMUS, links] = self._information[IMUS, links]
        return information

    def _repeat(self, later: Sequence[KeptStep]) -> None:
        """Repeat the steps after a late frame."""
        for step in later:
            if self._filter.state is None:
                break
            self._information = self._no_information()
            self._history.repeat(step, self._information)
        if self._filter.state is None:
            self.counters.add(RestartCause.NUMERICAL.value)

    def _predict_or_start(self, observation: Observation) -> bool:
        """Predict the filter to an observation's instant, or start it there.

        Returns:
            Whether the observation is used.
        """
        if self._filter.state is None:
            return self._start(observation)
        ahead_s = (observation.stamp_ns - self._history.stamp_ns) / NS_PER_S
        if ahead_s <= -JUMP_BACK_S:
            return self._start(observation, RestartCause.TIME_JUMP)
        if ahead_s >= self.parameters.forget_after:
            has_imus = len(observation.imus) > 0 and self._has_aligned
            if not has_imus or ahead_s > MAX_BRIDGED_S:
                return self._start(observation, RestartCause.GAP)
        self._history.predict_to(observation.stamp_ns)
        return True

    @property
    def _has_aligned(self) -> bool:
        """Whether at least one IMU is aligned."""
        return any(use.is_aligned for use in self.imu_uses)

    def _start(self, observation: Observation, cause: RestartCause | None = None) -> bool:
        """Start the filter where the cameras see the person; with a cause if it restarts.

        Returns:
            Whether it started: without the trunk, or other cameras' first frames, it waits.
        """
        joints, waits = self._start_frames.choose(observation.stamp_ns)
        if joints is None:
            joints = nan_mean(observation.positions)
        return not waits and self._start_at(observation, joints, cause)

    def _start_at(
        self, observation: Observation, joints: FloatArray, cause: RestartCause | None
    ) -> bool:
        """Start the filter at joints, (15, 3) [m]; False if the trunk is not among them."""
        if not self._filter.start(joints):
            self.counters.add("frames_without_trunk")
            return False
        self.counters.add("filter_starts")
        if cause:
            self.counters.add(cause.value)
        self._alignments.restart()
        self._facing.restart()
        self._crossed.restart()
        self._history.restart(observation.stamp_ns)
        self._diverged_since_ns = None
        return True

    def _update_filter(
        self, observation: Observation, is_late: bool, information: FloatArray
    ) -> StepResult | None:
        """Update the state with all measurements of an observation; None if this failed."""
        assert self._filter.state is not None
        imus, alignments_before = observation.imus, self._alignments.changes
        walks: Sequence[tuple[int, float]] = ()
        if not is_late:
            walks = self._alignments.register(observation.stamp_ns, imus, self._filter.state)
        aligned = self._alignments.frame(imus)
        if not self._filter.update_with_imus(aligned, information[IMUS]):
            self.counters.add(RestartCause.NUMERICAL.value)
            return None
        self._information[IMUS] = information[IMUS]
        frames = []
        result = StepResult(True, 0, float("nan"), float("nan"))
        tracked = np.full(observation.positions.shape, np.nan) if len(imus) else None
        for sensor, joints in enumerate(observation.tracking_state.tolist()):
            if not any(joints) or not self._uses_cameras():
                continue
            frame, cause = self._frame(observation, sensor)
            if cause and self._start_at(observation, nan_mean(observation.positions), cause):
                self._alignments.restart(discard=True)
                return result
            result = self._filter.update_with_frame(frame, information[CAMERAS])
            if not result.is_finite:
                self.counters.add(RestartCause.NUMERICAL.value)
                return None
            frames.append(frame)
            self.counters.add("limbs_turned_back", result.turned_back)
            self._information[CAMERAS] = information[CAMERAS]
            if tracked is not None:
                is_tracked = frame.tracking_state[:, None] == int(TrackingState.TRACKED)
                np.copyto(tracked[sensor], frame.positions, where=is_tracked)
        if tracked is not None and is_late:
            self._alignments.add_to_slips(observation, tracked, self._filter.state)
        elif tracked is not None:
            state = self._alignments.observe(observation, tracked, self._filter.state)
            self._filter.state = state
        if self._alignments.changes == alignments_before:
            self._history.finish(walks, aligned, frames)
        else:
            self._history.clear()
        return result

    def _frame(
        self, observation: Observation, sensor: int
    ) -> tuple[CameraFrame, RestartCause | None]:
        """One camera's frame with its swaps corrected; what is wrong with the state, or None."""
        assert self._filter.state is not None
        measured = CameraFrame(
            sensor,
            np.ascontiguousarray(observation.positions[sensor]),
            np.ascontiguousarray(observation.tracking_state[sensor]),
            np.ascontiguousarray(observation.cameras[sensor]),
        )
        frame, swaps = self._filter.undo_swaps(measured)
        self.counters.add("sides_swapped", swaps)
        state = self._filter.state
        passed_s = min(state.views.silent_s[sensor], MAX_STEP_S) / len(state.views.silent_s)
        is_crossed = self._crossed.is_crossed(measured, swaps, passed_s)
        if self._facing.faces_backwards(measured, state.pose.rotations[0], passed_s):
            return frame, RestartCause.BACKWARDS
        return frame, RestartCause.CROSSED if is_crossed else None

    def _uses_cameras(self) -> bool:
        """Whether the filter uses the cameras' frames."""
        return True

    def _has_diverged(self, observation: Observation, result: StepResult) -> bool:
        """Whether the filter has lost the person for too long."""
        if isnan(result.lost_share):
            return False
        if result.lost_share <= DIVERGED_SHARE:
            self._diverged_since_ns = None
            return False
        if self._diverged_since_ns is None or observation.stamp_ns < self._diverged_since_ns:
            self._diverged_since_ns = observation.stamp_ns
        return observation.stamp_ns - self._diverged_since_ns > DIVERGED_NS

    def _no_information(self) -> FloatArray:
        return np.zeros((2, self._filter.layout.links, 3, 3))

    def _published(
        self,
        state: FilterState,
        information: FloatArray,
        ahead_s: float = 0.0,
        imus: ImuFrame = NO_IMUS,
    ) -> PublishedState:
        """The published part of a state advanced by ``ahead_s`` [s], to the IMUs' instant."""
        scale = self._variance_scale(state)
        return self._filter.published(state, information, scale, ahead_s, imus)

    def _variance_scale(self, state: FilterState) -> float:
        """Factor [-] of the variances that are published."""
        by_depth = depth_variance_scale(state.views.depth_error_power, state.views.depth_noise)
        return float(variance_scale(self._mean_nis) * by_depth)
