"""The chain's second part: from observations to poses."""

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.estimator import Estimator
from pose_core.estimators.registry import estimator_class
from pose_core.fusion.observation_block import ObservationBlock
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock
from pose_core.imu.readings import SegmentReadings


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

    def take(self, block: ObservationBlock, shape: BodyShape) -> PoseBlock | None:
        """The poses that observations complete, if they do.

        Args:
            block: Observations of one body.
            shape: That body's; another one begins anew.
        """
        if self._estimator is None or shape is not self._shape:
            self._shape = shape
            self._estimator = self._class(self._model, shape, self._parameters, self._counters)
        return self._counted(self._estimator.track(block))

    def flush(self, newest_ns: int) -> PoseBlock | None:
        """What is left when nothing comes any more.

        Args:
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        poses = [] if self._estimator is None else self._estimator.flush()
        if self._estimator is None or not poses:
            return None
        return self._counted(self._estimator.block_of(poses, [newest_ns] * len(poses)))

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
        return None if pose is None else self._estimator.block_of([pose], [newest_ns])

    def _counted(self, block: PoseBlock | None) -> PoseBlock | None:
        if block is not None:
            self._counters.add("estimates", len(block.stamps_ns))
        return block
