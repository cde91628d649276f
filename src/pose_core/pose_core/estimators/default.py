"""``default``: the filter of :mod:`pose_core.filter`, updated with each sensor's frame.

This module decides what happens with a frame: predict to it and update, go back for a late one,
start or restart the filter. The arithmetic is in :mod:`pose_core.filter.step`.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import ClassVar

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape, with_shorter_arms
from pose_core.counters import Counters
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import TimedPose
from pose_core.estimators.estimator import Estimator, StepwiseEstimator
from pose_core.estimators.filter_output import FilterOutput, knows_enough_links
from pose_core.estimators.parameters import PipelineParameters
from pose_core.filter.error_state_filter import ErrorStateFilter
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu_alignments import ImuAlignments
from pose_core.filter.restart_cause import RestartCause
from pose_core.filter.start_frames import StartFrames
from pose_core.filter.state import CAMERA_TIMEOUT_S, FilterState
from pose_core.filter.state_checks import StateChecks
from pose_core.filter.step import StepResult
from pose_core.filter.step_history import KeptStep, StepHistory
from pose_core.filter.tuning import FilterTuning, load_tuning
from pose_core.finite_numbers import nan_mean
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.kernels.published_state import CAMERAS, IMUS, PublishedState
from pose_core.stamps import JUMP_BACK_NS, NS_PER_S

SAME_INSTANT_S = 0.005  # [s] by which a frame may be late and be used as if it were not
UNKEPT_S = 0.03  # [s] the same while the steps since are not kept, as before the first late frame
MAX_LEAD_S = 0.1  # [s] by which a frame's stamp may be ahead of the host's clock
MAX_BRIDGED_S = 5.0  # [s] silence of all sensors after which aligned IMUs do not go on
JUMP_BACK_S = JUMP_BACK_NS / NS_PER_S


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
        self._checks = StateChecks()
        self._start_frames = StartFrames(sensors)
        self._history = StepHistory(self._filter)
        self._output = FilterOutput(self._filter)

    @classmethod
    def maker(cls, parameters: PipelineParameters) -> Callable[..., Estimator]:
        """What makes a pipeline's estimators, with the tuning of the parameters' file."""
        return partial(cls, tuning=load_tuning(parameters.tuning))

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
        state = self._filter.state
        if information is None or state is None or not self._is_known(state):
            return None
        return self._output.published(state, information)

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
        information, alignments_before = self._output.no_information(), self._alignments.changes
        result = self._update_filter(observation, is_late, information)
        if result is None:
            return None
        has_diverged = self._checks.has_diverged(observation.stamp_ns, result.lost_share)
        if has_diverged and not self._start(observation, RestartCause.DIVERGED):
            return None
        if is_late:
            if self._alignments.changes == alignments_before:  # otherwise it has restarted
                self._repeat(later)
            self._filter.predicted_from = predicted_from  # what is interpolated from
            self.counters.add("frames_late_but_used")
            return None
        self._output.add_nis(max(min(ahead_s, 1.0), 0.0), result.mean_nis)
        return information

    def predicted(self, stamp_ns: int, imus: ImuMeasurements) -> TimedPose | None:
        """Predict the state to an instant; links with an aligned IMU follow its samples."""
        ahead_s = (stamp_ns - self._history.stamp_ns) / NS_PER_S
        state = self._filter.state
        if state is None or not -MAX_LEAD_S <= ahead_s < self.parameters.forget_after:
            return None
        ahead_s = max(ahead_s, 0.0)
        if not self._is_known(state, ahead_s):
            return None
        pose = self._output.predicted(state, ahead_s, self._alignments.frame(imus))
        return TimedPose(stamp_ns=stamp_ns, pose=pose)

    @property
    def stamp_ns(self) -> int | None:
        """Instant of the state [ns]; None if there is none."""
        return None if self._filter.state is None else self._history.stamp_ns

    def interpolated(self, stamps_ns: Sequence[int]) -> PublishedState | None:
        """States at instants between the last two observations."""
        state = self._filter.state
        if state is None or not stamps_ns or not self._is_known(state):
            return None
        ages_s = (self._history.stamp_ns - np.array(stamps_ns)) / NS_PER_S
        return self._output.interpolated(state, ages_s)

    def _is_known(self, state: FilterState, ahead_s: float = 0.0) -> bool:
        """Whether a state is more than a guess: cameras see the person, or IMUs tell enough.

        Args:
            state: The state.
            ahead_s: Time since then [s].
        """
        is_seen = min(state.views.silent_s.tolist()) + ahead_s < self.parameters.forget_after
        return is_seen or knows_enough_links(state)

    def _repeat(self, later: Sequence[KeptStep]) -> None:
        """Repeat the steps after a late frame."""
        for step in later:
            if self._filter.state is None:
                break
            self._output.information = self._output.no_information()
            self._history.repeat(step, self._output.information)
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
        self._checks.restart()
        self._history.restart(observation.stamp_ns)
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
        self._output.information[IMUS] = information[IMUS]
        frames: list[CameraFrame] = []
        result = StepResult(True, 0, float("nan"), float("nan"))
        for sensor, joints in enumerate(observation.tracking_state.tolist()):
            if not any(joints) or not self._uses_cameras(imus.segments):
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
            self._output.information[CAMERAS] = information[CAMERAS]
        if len(imus) and is_late:
            self._alignments.add_to_slips(observation, frames, self._filter.state)
        elif len(imus):
            self._filter.state = self._alignments.observe(observation, frames, self._filter.state)
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
        return frame, self._checks.check_sides(measured, swaps, self._filter.state)

    def _uses_cameras(self, segments: Sequence[str]) -> bool:
        """Whether the filter uses the cameras' frames.

        Args:
            segments: Of the IMUs with samples at the frame's instant.
        """
        del segments
        return True
