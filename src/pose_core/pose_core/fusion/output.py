"""The chain's last part: from an estimator's poses to what is published of a person."""

import numpy as np
from numpy.typing import NDArray

from pose_core.body.hinge_plane import hinges_of
from pose_core.body.kinematics import model_arrays
from pose_core.body.model import ROOT_DOF, BodyModel
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import BodyShape
from pose_core.estimators.registry import estimator_class
from pose_core.estimators.uncertainty import VarianceCalibrations, coefficients_of
from pose_core.fusion.estimates import EstimateBlock
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock, StateBlock
from pose_core.joints import JOINTS, TrackingState
from pose_core.kernels.compiling import type_specialised
from pose_core.kernels.forward_kinematics import ModelArrays
from pose_core.kernels.joint_angle_extraction import StateNumbers
from pose_core.kernels.output import OutputBody, PoseOutput, output_states
from pose_core.kernels.output_blending import make_blending
from pose_core.streams.samples import FloatArray

TRACKED_STDDEV = 0.25  # [m] of a joint that counts as tracked, over its three axes
INFERRED_STDDEV = 0.60  # [m] of one that is known at all
MEASURED = 1.0  # [1/rad²] information on a link that is measured


LARGEST_STDDEV = np.pi / np.sqrt(3.0)  # [rad] of an angle that may be anything, 104°
LEAST_STDDEV = np.radians(0.5)  # [rad] of an angle
START_STDDEV = np.radians(30.0)  # [rad] of the angles, from which on a pose is published


def joint_stddev(states: StateNumbers, numbers: ModelArrays) -> FloatArray:
    """Standard deviation of each joint's position over its three axes, (n, joints) [m].

    A joint at p in a link whose rotation is off by a small vector with covariance C is off by
    tr(C) |p|² − pᵀ C p; the deviations of a chain's links add up from the root on.

    Args:
        states: n rows; the covariances are of each link relative to its parent.
        numbers: The body model.
    """
    count, links = states.rotations.shape[:2]
    absolute = np.empty((count, links, 3, 3))
    base = np.empty((count, links))
    variance = np.empty((count, len(numbers.offsets)))
    for link in range(links):
        parent, about = int(numbers.parents[link]), int(numbers.turns_about[link])
        absolute[:, link] = states.covariance[:, link]
        if parent >= 0:
            absolute[:, link] += absolute[:, parent]
        base[:, link] = states.place_variance.sum(axis=1) if about < 0 else variance[:, about]
        C = absolute[:, link]
        for joint in np.flatnonzero(numbers.link_of_joint == link).tolist():
            p = states.rotations[:, link] @ numbers.offsets[joint]
            squared = float(numbers.offsets[joint] @ numbers.offsets[joint])
            turned = np.trace(C, axis1=1, axis2=2) * squared - np.einsum("ni,nij,nj->n", p, C, p)
            variance[:, joint] = base[:, link] + np.maximum(turned, 0.0)
    return np.sqrt(variance * states.scale)


def tracking_states(states: StateNumbers, numbers: ModelArrays) -> NDArray[np.uint8]:
    """Tracking state of each joint of the estimate, (n, joints): tracked if it is measured now."""
    stddev = joint_stddev(states, numbers)
    information = np.trace(states.information.sum(axis=1), axis1=2, axis2=3)
    is_measured = (information > MEASURED)[:, numbers.link_of_joint]
    state = np.full(stddev.shape, int(TrackingState.NOT_TRACKED), np.uint8)
    state[stddev <= INFERRED_STDDEV] = int(TrackingState.INFERRED)
    state[is_measured & (stddev <= TRACKED_STDDEV)] = int(TrackingState.TRACKED)
    return state


class Output:
    """Makes estimates of poses; a body's angles go on from one block to the next."""

    def __init__(self, model: BodyModel, parameters: FusionParameters) -> None:
        self._model = model
        self._sensors = parameters.sensors
        self._calibrations = estimator_class(parameters.estimator).VARIANCE_CALIBRATION
        self._shape: BodyShape | None = None
        self._states: _StateOutput | None = None

    def estimates(self, block: PoseBlock, shape: BodyShape) -> EstimateBlock | None:
        """What is published of poses; None before the pose is known.

        Args:
            block: Of one body.
            shape: That body's; another one's angles begin anew.
        """
        if isinstance(block, EstimateBlock):
            return block
        if self._states is None or shape is not self._shape:
            self._shape = shape
            self._states = _StateOutput(self._model, shape, self._calibrations, self._sensors)
        return self._states.estimates(block)


class _StateOutput:
    """Turns a segment filter's states into the model's degrees of freedom, continuously.

    Args:
        model: The body model.
        shape: The person's measures.
        calibrations: How much the filter's variances are worth.
        sensors: Their names.
    """

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        calibrations: VarianceCalibrations,
        sensors: tuple[str, ...],
    ) -> None:
        self._model = model
        self._sensors = sensors
        self._offsets = shape.offsets
        no_limits = np.tile([-np.inf, np.inf], (ROOT_DOF, 1))
        self._body = OutputBody(
            numbers=model_arrays(model, shape.offsets),
            limits=np.concatenate([no_limits, np.asarray(model.limits, float)]),
            hinges=hinges_of(SegmentTree(model, shape)),
            variance_calibration=coefficients_of(model, calibrations),
        )
        self._output_states = type_specialised(output_states)
        self._blending = make_blending(model.size)
        # A straight limb's turn about itself need not be known.
        self._must_be_known = np.array([not name.endswith("rotation") for name in model.dof_names])
        self._has_begun = False

    def estimates(self, block: StateBlock) -> EstimateBlock | None:
        """What is published of states, from the first on that is known well enough."""
        estimates = self._estimates(block)
        if self._has_begun:
            return estimates
        stddev = estimates.position_stddev[:, self._must_be_known].max(axis=1)
        known = np.flatnonzero(stddev <= START_STDDEV)
        self._has_begun = len(known) > 0
        return estimates.rows(slice(int(known[0]), None)) if self._has_begun else None

    def _estimates(self, block: StateBlock) -> EstimateBlock:
        model, size, links = self._model, self._model.size, len(self._model.link_names)
        count, sensors = block.tracking_state.shape[:2]
        position, velocity, variance, weight_kinect, weight_imu = np.empty((5, count, size))
        output = PoseOutput(
            position=position,
            velocity=velocity,
            variance=variance,
            is_known=np.empty((count, size), np.bool_),
            weight_kinect=weight_kinect,
            weight_imu=weight_imu,
            source=np.empty((count, size), np.uint8),
            joints=np.empty((count, len(JOINTS), 3)),
            placed_joints=np.empty((count, len(JOINTS), 3)),
            T_map_link=np.empty((count, links, 4, 4)),
            sensor_weight=np.empty((count, sensors, len(JOINTS))),
        )
        stamps_ns, states = block.stamps_ns, block.states
        self._output_states(
            self._body, stamps_ns, states, block.tracking_state, self._blending, output
        )
        # A smoothed covariance may be indefinite by rounding.
        stddev = np.sqrt(np.maximum(output.variance, 0.0))
        stddev[:, ROOT_DOF:] = np.clip(stddev[:, ROOT_DOF:], LEAST_STDDEV, LARGEST_STDDEV)
        return EstimateBlock(
            stamps_ns=stamps_ns,
            newest_ns=block.newest_ns,
            dof_names=model.dof_names,
            position=output.position,
            velocity=output.velocity,
            position_stddev=stddev,
            is_known=output.is_known,
            weight_kinect=output.weight_kinect,
            weight_imu=output.weight_imu,
            source=output.source,
            joints=output.joints,
            placed_joints=output.placed_joints,
            tracking_state=tracking_states(states, self._body.numbers),
            link_names=model.link_names,
            T_map_link=output.T_map_link,
            sensors=self._sensors,
            sensor_weight=output.sensor_weight,
        )
