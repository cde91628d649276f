"""Second part of the pipeline: from observations to estimates, with the selected estimator."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimates.body_estimates import BodyEstimate, EstimateBlock
from pose_core.estimates.observation import Observation
from pose_core.estimates.poses import (
    FusedPose,
    StateBlock,
    TimedPose,
    block_of_poses,
    joined_states,
    state_block,
)
from pose_core.estimators.estimator import Estimator
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.registry import estimator_class
from pose_core.fusion.output import StateOutput
from pose_core.fusion.output_grid import has_output_rate
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.stamps import NS_PER_S

EstimatorMaker = Callable[[BodyModel, BodyShape, PipelineParameters, Counters], Estimator]


def runner_counters(parameters: PipelineParameters) -> tuple[str, ...]:
    """Names of the counters of an :class:`EstimatorRunner`."""
    return ("estimates", *estimator_class(parameters.estimator).COUNTERS)


class NotStarted(Estimator):
    """Stands for the estimator until the body is measured: it has no pose, no IMU, no delay."""

    def __init__(self) -> None:
        """It needs nothing."""

    def track(self, observation: Observation) -> list[TimedPose]:
        """No pose."""
        del observation
        return []


class EstimatorRunner:
    """Runs the estimator named in the parameters and converts its poses to estimates.

    Args:
        model: The body model.
        parameters: See :class:`PipelineParameters`.
        counters: Declares :func:`runner_counters`.
        make: Factory of the estimator; its class if None.

    Raises:
        ParameterError: If the estimator cannot work with the parameters.
    """

    def __init__(
        self,
        model: BodyModel,
        parameters: PipelineParameters,
        counters: Counters,
        make: EstimatorMaker | None = None,
    ) -> None:
        kind = estimator_class(parameters.estimator)
        own = kind.maker(parameters)
        self._make: EstimatorMaker = make or own
        self._model = model
        self._parameters = parameters
        self._counters = counters
        self._calibrations = kind.VARIANCE_CALIBRATION
        self._output: StateOutput | None = None
        self._shape: BodyShape | None = None
        self.estimator: Estimator = NotStarted()
        self._sensor_to_segment: SensorsToSegments = {}
        self.tracker_delay_s = parameters.tracker_delay
        """Prior mean of the trackers' delays [s], for estimators that are made from now on."""
        self._publishes_frames = not has_output_rate(parameters)
        # What waits to be converted together: an estimator gives either.
        self._states: list[StateBlock] = []
        self._poses: list[tuple[FusedPose, int, int]] = []  # with their stamps, and the newest [ns]
        self._count = 0  # of all these
        self._finished: list[EstimateBlock] = []  # converted, not taken yet

    def process(self, observation: Observation) -> None:
        """Process an observation; its poses wait for :meth:`take`, if frames are published."""
        estimator = self._estimator_of(observation)
        if not self._publishes_frames:
            estimator.advance(observation)
            return
        for pose in estimator.track(observation):
            self._add(pose, observation.newest_ns)

    def _estimator_of(self, observation: Observation) -> Estimator:
        """The estimator; a new body shape starts a new one."""
        if observation.shape is not self._shape:
            self._convert()
            self._shape = observation.shape
            self._output = StateOutput(self._model, observation.shape, self._calibrations)
            parameters = replace(self._parameters, tracker_delay=self.tracker_delay_s)
            self.estimator = self._make(self._model, observation.shape, parameters, self._counters)
            self.estimator.use_sensor_to_segment(self._sensor_to_segment)
        return self.estimator

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use sensor-to-segment rotations of a calibration."""
        self._sensor_to_segment = alignments
        self.estimator.use_sensor_to_segment(alignments)

    @property
    def tracker_delays_ns(self) -> dict[str, int]:
        """Delay of each sensor's tracker [ns], to subtract from its stamps."""
        delays_s = self.estimator.tracker_delays_s
        if delays_s is None:
            return {}
        delays_ns = (round(delay_s * NS_PER_S) for delay_s in delays_s.tolist())
        return dict(zip(self._parameters.sensors, delays_ns, strict=True))

    def predict(self, stamp_ns: int, newest_ns: int, imus: ImuMeasurements) -> None:
        """Predict the pose to a later instant; it waits for :meth:`take`. The estimator stays.

        Args:
            stamp_ns: The instant [ns].
            newest_ns: Stamp of the newest sample of any source [ns].
            imus: Samples of the IMUs at that instant, extrapolated by their gyroscopes.
        """
        pose = self.estimator.predicted(stamp_ns, imus)
        if pose is not None:
            self._add(pose, newest_ns)

    def interpolate(self, stamps_ns: Sequence[int], newest_ns: int) -> None:
        """Add poses at instants up to the estimator's; they wait for :meth:`take`.

        Args:
            stamps_ns: The instants [ns], after the observation before the last one.
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        states = self.estimator.interpolated(stamps_ns)
        if states is not None:
            stamps, newest = np.array(stamps_ns), np.full(len(stamps_ns), newest_ns)
            self._states.append(StateBlock(stamps_ns=stamps, newest_ns=newest, states=states))
            self._count += len(stamps_ns)

    def predict_one(
        self, stamp_ns: int, newest_ns: int, imus: ImuMeasurements
    ) -> BodyEstimate | None:
        """As :meth:`predict`, but returns the estimate; those that wait go on waiting."""
        earlier = self.take()
        self.predict(stamp_ns, newest_ns, imus)
        blocks = self.take()
        self._finished = earlier
        return blocks[0][0] if blocks else None

    def flush(self, newest_ns: int) -> None:
        """Add the estimator's remaining poses, after the end of the streams.

        Args:
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        for pose in self.estimator.flush():
            self._add(pose, newest_ns)

    def take(self, least: int = 1) -> list[EstimateBlock]:
        """Remove and return the estimates of the poses that wait, once there are ``least``."""
        if self._count >= least:
            self._convert()
        finished, self._finished = self._finished, []
        return finished

    def _add(self, timed: TimedPose, newest_ns: int) -> None:
        self._count += 1
        if isinstance(timed.pose, FusedPose):
            self._poses.append((timed.pose, timed.stamp_ns, newest_ns))
        else:
            self._states.append(state_block(timed.pose, timed.stamp_ns, newest_ns))

    def _convert(self) -> None:
        """Convert the poses that wait, which are of one body."""
        if self._output is None:
            return
        block: EstimateBlock | None = None
        if self._states:
            block = self._output.estimates(joined_states(self._states))
        elif self._poses:
            poses, stamps_ns, newest_ns = zip(*self._poses, strict=True)
            block = block_of_poses(poses, stamps_ns, newest_ns, self._model)
        self._states, self._poses, self._count = [], [], 0
        if block is not None:
            self._counters.add("estimates", len(block))
            self._finished.append(block)
