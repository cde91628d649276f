"""The chain's second part: from observations to poses."""

from collections.abc import Iterable, Sequence

from pose_common.counters import Counters
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.fusion.estimators.estimator import Estimator, Observation, TimedPose
from pose_fusion.fusion.estimators.registry import estimator_class
from pose_fusion.fusion.parameters import FusionParameters
from pose_fusion.fusion.pose_block import PoseBlock, block_of_poses
from pose_fusion.imu.readings import SegmentReadings


def tracking_counters(parameters: FusionParameters) -> tuple[str, ...]:
    """What a :class:`Tracking` counts."""
    return ("estimates", *estimator_class(parameters.estimator).COUNTERS)


class Tracking:
    """Runs the estimator that the parameters name.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
        counters: Declares :func:`tracking_counters`.

    Raises:
        ParameterError: If the estimator cannot work with the parameters.
    """

    def __init__(self, model: BodyModel, parameters: FusionParameters, counters: Counters) -> None:
        self._class = estimator_class(parameters.estimator)
        self._class.check(parameters)
        self._model = model
        self._parameters = parameters
        self._counters = counters
        self._shape: BodyShape | None = None
        self._estimator: Estimator | None = None

    def take(self, observations: Iterable[Observation]) -> PoseBlock | None:
        """The poses that observations of one body complete, if they do."""
        poses: list[TimedPose] = []
        newest_ns: list[int] = []
        for observation in observations:
            completed = self._estimator_of(observation.shape).advance(observation)
            poses += completed
            newest_ns += [observation.newest_ns] * len(completed)
        return self._counted(poses, newest_ns)

    def flush(self, newest_ns: int) -> PoseBlock | None:
        """What is left when nothing comes any more.

        Args:
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        poses = [] if self._estimator is None else self._estimator.flush()
        return self._counted(poses, [newest_ns] * len(poses))

    def predict(self, stamp_ns: int, newest_ns: int, readings: SegmentReadings) -> PoseBlock | None:
        """The pose at a later instant, as far as it is known; leaves everything as it is.

        Args:
            stamp_ns: The instant [ns].
            newest_ns: Stamp of the newest sample of any source [ns].
            readings: Of the aligned IMUs at that instant, carried on by their gyroscopes.
        """
        if self._estimator is None:
            return None
        pose = self._estimator.predicted(stamp_ns, readings)
        return None if pose is None else self._block([pose], [newest_ns])

    def _estimator_of(self, shape: BodyShape) -> Estimator:
        """The estimator of a body: another one begins anew."""
        if self._estimator is None or shape is not self._shape:
            self._shape = shape
            self._estimator = self._class(self._model, shape, self._parameters, self._counters)
        return self._estimator

    def _counted(self, poses: Sequence[TimedPose], newest_ns: Sequence[int]) -> PoseBlock | None:
        self._counters.add("estimates", len(poses))
        return self._block(poses, newest_ns) if poses else None

    def _block(self, poses: Sequence[TimedPose], newest_ns: Sequence[int]) -> PoseBlock:
        return block_of_poses(poses, newest_ns, self._model, self._parameters.sensors)
