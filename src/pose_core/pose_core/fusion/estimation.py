"""From observations to estimates, in one process: what tracks a body, and what tells its poses."""

from collections.abc import Iterable

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.fusion.estimates import EstimateBlock
from pose_core.fusion.observation_block import Observation, block_of_observations
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.preparing import prepare
from pose_core.fusion.telling import Telling
from pose_core.fusion.tracking import Tracking
from pose_core.imu.readings import SegmentReadings


class Estimation:
    """Runs the estimator that the parameters name, and tells its poses.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
        counters: Declares :func:`tracking_counters`.

    Raises:
        ParameterError: If the estimator cannot work with the parameters.
    """

    def __init__(self, model: BodyModel, parameters: FusionParameters, counters: Counters) -> None:
        self._tracking = Tracking(model, parameters, counters)
        self._telling = Telling(model, parameters)
        self._shape: BodyShape | None = None
        prepare(parameters.estimator, model.name)

    def take(self, observations: Iterable[Observation]) -> list[EstimateBlock]:
        """The estimates that observations complete, a block for each."""
        blocks = []
        for observation in observations:
            self._shape = observation.shape
            poses = self._tracking.take(block_of_observations([observation]), self._shape)
            if poses is not None:
                blocks.append(self._telling.tell(poses, self._shape))
        return blocks

    def flush(self, newest_ns: int) -> list[EstimateBlock]:
        """What is left to be told when nothing comes any more: none or one block.

        Args:
            newest_ns: Stamp of the newest sample of any source [ns].
        """
        poses = self._tracking.flush(newest_ns)
        if poses is None or self._shape is None:
            return []
        return [self._telling.tell(poses, self._shape)]

    def predict(
        self, stamp_ns: int, newest_ns: int, readings: SegmentReadings
    ) -> EstimateBlock | None:
        """The pose at a later instant, as far as it is known; leaves everything as it is.

        Args:
            stamp_ns: The instant [ns].
            newest_ns: Stamp of the newest sample of any source [ns].
            readings: Of the aligned IMUs at that instant, carried on by their gyroscopes.
        """
        poses = self._tracking.predict(stamp_ns, newest_ns, readings)
        return None if poses is None else self._telling.tell_ahead(poses)
