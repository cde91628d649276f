"""Second part of the pipeline: from observations to estimates, with the selected estimator."""

from collections.abc import Callable

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.estimator import Estimator
from pose_core.estimators.registry import estimator_class
from pose_core.filter.imu_use import ImuUse
from pose_core.fusion.estimates import BodyEstimate, EstimateBlock
from pose_core.fusion.observation import Observation
from pose_core.fusion.output import Output
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock, TimedPose
from pose_core.imu.imu_history import ImuStates
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.stamps import NS_PER_S

EstimatorMaker = Callable[[BodyModel, BodyShape, FusionParameters, Counters], Estimator]


def runner_counters(parameters: FusionParameters) -> tuple[str, ...]:
    """Names of the counters of an :class:`EstimatorRunner`."""
    return ("estimates", *estimator_class(parameters.estimator).COUNTERS)


class EstimatorRunner:
    """Runs the estimator named in the parameters and converts its poses to estimates.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
        counters: Declares :func:`runner_counters`.
        make: Factory of the estimator; its class if None.

    Raises:
        ParameterError: If the estimator cannot work with the parameters.
    """

    def __init__(
        self,
        model: BodyModel,
        parameters: FusionParameters,
        counters: Counters,
        make: EstimatorMaker | None = None,
    ) -> None:
        kind = estimator_class(parameters.estimator)
        kind.check(parameters)
        self._make: EstimatorMaker = make or kind
        self._model = model
        self._parameters = parameters
        self._counters = counters
        self._output = Output(model, parameters)
        self._shape: BodyShape | None = None
        self._estimator: Estimator | None = None
        self._sensor_to_segment: SensorsToSegments = {}
        self._predicted: list[TimedPose] = []
        self._newest_ns: list[int] = []  # for each of them
        self._finished: list[EstimateBlock] = []  # converted, not returned yet

    def advance(self, observation: Observation) -> None:
        """Process an observation whose pose is not published."""
        self._estimator_of(observation).advance(observation)

    def update(self, observation: Observation) -> PoseBlock | None:
        """Process an observation; return its poses."""
        estimator = self._estimator_of(observation)
        poses = estimator.track(observation)
        return estimator.block_of(poses, [observation.newest_ns] * len(poses)) if poses else None

    def _estimator_of(self, observation: Observation) -> Estimator:
        """The estimator; a new body shape starts a new one."""
        if self._estimator is None or observation.shape is not self._shape:
            self._finished += self.predicted()
            self._shape = observation.shape
            self._estimator = self._make(
                self._model, observation.shape, self._parameters, self._counters
            )
            self._estimator.use_sensor_to_segment(self._sensor_to_segment)
        return self._estimator

    def estimates(self, poses: PoseBlock | None) -> list[EstimateBlock]:
        """Convert poses to estimates: no block or one."""
        if poses is None or self._shape is None:
            return []
        block = self._output.estimates(poses, self._shape)
        if block is None:
            return []
        self._counters.add("estimates", len(block))
        return [block]

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use sensor-to-segment rotations of a calibration."""
        self._sensor_to_segment = alignments
        if self._estimator is not None:
            self._estimator.use_sensor_to_segment(alignments)

    @property
    def sensor_to_segment(self) -> SensorsToSegments:
        """Sensor-to-segment rotations of the aligned IMUs."""
        return {} if self._estimator is None else self._estimator.sensor_to_segment

    @property
    def tracker_delays_ns(self) -> dict[str, int]:
        """Delay of each sensor's tracker [ns], to subtract from its stamps."""
        delays_s = None if self._estimator is None else self._estimator.tracker_delays_s
        if delays_s is None:
            return {}
        return {
            sensor: round(delay_s * NS_PER_S)
            for sensor, delay_s in zip(self._parameters.sensors, delays_s.tolist(), strict=True)
        }

    @property
    def uses_imus(self) -> bool:
        """Whether there is an estimator, and it takes IMUs' readings."""
        return self._estimator is not None and self._estimator.USES_IMUS

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """State of use of each IMU with samples."""
        return () if self._estimator is None else self._estimator.imu_uses

    def flush(self, newest_ns: int) -> list[EstimateBlock]:
        """The remaining estimates, after the end of the streams: no block or one.

        Args:
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        poses = [] if self._estimator is None else self._estimator.flush()
        if self._estimator is None or not poses:
            return []
        return self.estimates(self._estimator.block_of(poses, [newest_ns] * len(poses)))

    def predict(self, stamp_ns: int, newest_ns: int, readings: ImuStates) -> None:
        """Predict the pose to a later instant; :meth:`predicted` returns it. The estimator stays.

        Args:
            stamp_ns: The instant [ns].
            newest_ns: Stamp of the newest sample of any source [ns].
            readings: Samples of the IMUs at that instant, extrapolated by their gyroscopes.
        """
        pose = None if self._estimator is None else self._estimator.predicted(stamp_ns, readings)
        if pose is not None:
            self._predicted.append(pose)
            self._newest_ns.append(newest_ns)

    def predict_one(
        self, stamp_ns: int, newest_ns: int, readings: ImuStates
    ) -> BodyEstimate | None:
        """As :meth:`predict`, but returns the estimate; those that wait are converted first."""
        waiting = self.predicted()
        self.predict(stamp_ns, newest_ns, readings)
        blocks = self.predicted()
        self._finished = waiting
        return blocks[0][0] if blocks else None

    def predicted(self, least: int = 1) -> list[EstimateBlock]:
        """The estimates of the predicted poses, once there are at least ``least``."""
        finished, self._finished = self._finished, []
        if self._estimator is None or len(self._predicted) < least:
            return finished
        poses = self._estimator.block_of(self._predicted, self._newest_ns)
        self._predicted, self._newest_ns = [], []
        return finished + self.estimates(poses)
