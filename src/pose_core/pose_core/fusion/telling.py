"""The chain's last part: from an estimator's poses to what the fusion says of a person."""

import numpy as np

from pose_core.body.hinge_plane import hinges_of
from pose_core.body.kinematics import model_numbers
from pose_core.body.model import BodyModel
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import BodyShape
from pose_core.estimators.registry import estimator_class
from pose_core.estimators.uncertainty import Trusts, numbers_of
from pose_core.fusion.estimates import EstimateBlock
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock, StateBlock
from pose_core.joints import JOINTS
from pose_core.kernels.compiling import settled
from pose_core.kernels.telling import BodyAsTold, Told, tell
from pose_core.streams.samples import FloatArray

OWN_RATES = np.zeros(0)


class Telling:
    """Tells poses that are not told yet; a body's angles go on from one block to the next.

    Args:
        model: The body model.
        parameters: See :class:`FusionParameters`.
    """

    def __init__(self, model: BodyModel, parameters: FusionParameters) -> None:
        self._model = model
        self._sensors = parameters.sensors
        self._trusts = estimator_class(parameters.estimator).TRUSTS
        self._shape: BodyShape | None = None
        self._reader: _StateReader | None = None

    def tell(self, block: PoseBlock, shape: BodyShape) -> EstimateBlock:
        """What the fusion says of poses.

        Args:
            block: Of one body.
            shape: That body's; another one's angles begin anew.
        """
        if isinstance(block, EstimateBlock):
            return block
        if self._reader is None or shape is not self._shape:
            self._shape = shape
            self._reader = _StateReader(self._model, shape, self._trusts, self._sensors)
        return self._reader.read(block)

    def tell_ahead(self, block: PoseBlock) -> EstimateBlock | None:
        """What it says of poses ahead of the last one, if there was one; the next follow that."""
        if isinstance(block, EstimateBlock):
            return block
        return None if self._reader is None else self._reader.read_ahead(block)


class _StateReader:
    """Turns a segment filter's states into the model's degrees of freedom, continuously.

    Args:
        model: The body model.
        shape: The person's measures.
        trusts: How much the filter's variances are worth.
        sensors: Their names.
    """

    def __init__(
        self, model: BodyModel, shape: BodyShape, trusts: Trusts, sensors: tuple[str, ...]
    ) -> None:
        self._model = model
        self._sensors = sensors
        self._body = BodyAsTold(
            numbers=model_numbers(model, shape.offsets),
            hinges=hinges_of(SegmentTree(model, shape)),
            trusts=numbers_of(model, trusts),
        )
        self._tell = settled(tell)
        self._previous = np.zeros(model.size)
        self._rates = np.zeros(model.size)

    def read(self, block: StateBlock) -> EstimateBlock:
        """What is said of states."""
        told = self._told(block, OWN_RATES, self._previous)
        self._rates = told.velocity[-1]
        return told

    def read_ahead(self, block: StateBlock) -> EstimateBlock:
        """The same of states ahead: as late as it was at the last, though its rates die away."""
        return self._told(block, self._rates, self._previous.copy())

    def _told(self, block: StateBlock, rates: FloatArray, previous: FloatArray) -> EstimateBlock:
        model, size, links = self._model, len(previous), len(self._model.link_names)
        count, sensors = block.tracking_state.shape[:2]
        position, velocity, variance, weight_kinect, weight_imu = np.empty((5, count, size))
        told = Told(
            position=position,
            velocity=velocity,
            variance=variance,
            weight_kinect=weight_kinect,
            weight_imu=weight_imu,
            source=np.empty((count, size), np.uint8),
            joints=np.empty((count, len(JOINTS), 3)),
            T_map_link=np.empty((count, links, 4, 4)),
            sensor_weight=np.empty((count, sensors, len(JOINTS))),
        )
        self._tell(self._body, block.states, block.tracking_state, rates, previous, told)
        return EstimateBlock(
            stamps_ns=block.stamps_ns,
            newest_ns=block.newest_ns,
            dof_names=model.dof_names,
            position=told.position,
            velocity=told.velocity,
            position_stddev=np.sqrt(told.variance),
            weight_kinect=told.weight_kinect,
            weight_imu=told.weight_imu,
            source=told.source,
            joints=told.joints,
            tracking_state=block.tracking_state.max(axis=1),
            link_names=model.link_names,
            T_map_link=told.T_map_link,
            sensors=self._sensors,
            sensor_weight=told.sensor_weight,
        )
