"""The chain's second half: from observations to estimates."""

from collections.abc import Iterable, Sequence

from pose_common.counters import Counters
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.fusion.estimates import EstimateBlock
from pose_fusion.fusion.estimators.estimator import Estimator, Observation, TimedPose
from pose_fusion.fusion.estimators.registry import estimator_class
from pose_fusion.fusion.parameters import FusionParameters
from pose_fusion.fusion.preparing import prepare
from pose_fusion.fusion.telling import told
from pose_fusion.imu.readings import SegmentReadings


def estimation_counters(parameters: FusionParameters) -> tuple[str, ...]:
    """What an :class:`Estimation` counts."""
    return ("estimates", *estimator_class(parameters.estimator).COUNTERS)


class Estimation:
    """Runs the estimator that the parameters name, and tells its poses.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
        counters: Declares :func:`estimation_counters`.

    Raises:
        ParameterError: If the estimator cannot work with the parameters.
    """

    def __init__(self, model: BodyModel, parameters: FusionParameters, counters: Counters) -> None:
        self._class = estimator_class(parameters.estimator)
        self._class.check(parameters)
        prepare(self._class, model.name)
        self._model = model
        self._parameters = parameters
        self._counters = counters
        self._shape: BodyShape | None = None
        self._estimator: Estimator | None = None

    def take(self, observations: Iterable[Observation]) -> list[EstimateBlock]:
        """The estimates that observations complete: none or one block."""
        poses: list[TimedPose] = []
        newest_ns: list[int] = []
        for observation in observations:
            completed = self._estimator_of(observation.shape).advance(observation)
            poses += completed
            newest_ns += [observation.newest_ns] * len(completed)
        return self._told(poses, newest_ns)

    def flush(self, newest_ns: int) -> list[EstimateBlock]:
        """What is left to be told when nothing comes any more: none or one block.

        Args:
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        poses = [] if self._estimator is None else self._estimator.flush()
        return self._told(poses, [newest_ns] * len(poses))

    def predict(
        self, stamp_ns: int, newest_ns: int, readings: SegmentReadings
    ) -> EstimateBlock | None:
        """The pose at a later instant, as far as it is known; leaves everything as it is.

        Args:
            stamp_ns: The instant [ns].
            newest_ns: Stamp of the newest sample of any source [ns].
            readings: Of the aligned IMUs at that instant, carried on by their gyroscopes.
        """
        if self._estimator is None:
            return None
        pose = self._estimator.predicted(stamp_ns, readings)
        if pose is None:
            return None
        return told([pose], [newest_ns], self._model, self._parameters.sensors)

    def _told(self, poses: Sequence[TimedPose], newest_ns: Sequence[int]) -> list[EstimateBlock]:
        self._counters.add("estimates", len(poses))
        if not poses:
            return []
        return [told(poses, newest_ns, self._model, self._parameters.sensors)]

    def _estimator_of(self, shape: BodyShape) -> Estimator:
        """The estimator of a body: another one begins anew."""
        if self._estimator is None or shape is not self._shape:
            self._shape = shape
            self._estimator = self._class(self._model, shape, self._parameters, self._counters)
        return self._estimator
