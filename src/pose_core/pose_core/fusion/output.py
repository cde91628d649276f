"""Last part of the pipeline: from an estimator's poses to published estimates."""

import numpy as np

from pose_core.body.kinematics import model_arrays
from pose_core.body.model import ROOT_DOF, BodyModel
from pose_core.body.segment_tree import SegmentTree, without_side
from pose_core.body.shape import BodyShape
from pose_core.estimates.body_estimates import EstimateBlock
from pose_core.estimates.poses import StateBlock
from pose_core.estimators.uncertainty import VarianceCalibrations, coefficients_of
from pose_core.joints import JOINTS
from pose_core.kernels.compiling import type_specialised
from pose_core.kernels.output import OutputBody, PoseOutput, output_states
from pose_core.kernels.output_blending import make_blending
from pose_core.kernels.tracking_states import tracking_states
from pose_core.stamps import NS_PER_S

MAX_STDDEV = np.pi / np.sqrt(3.0)  # [rad] of an unknown angle: uniform distribution, 104°
MIN_STDDEV = np.radians(0.5)  # [rad] of an angle
ROOT_POSITION = 3  # [-] degrees of freedom of the root's position; the next ones are angles
START_STDDEV = np.radians(30.0)  # [rad] of the angles, below which publishing starts
START_NS = 2 * NS_PER_S  # [ns] after the first pose, from which on it starts in any case


class StateOutput:
    """Converts a filter's states to estimates; the angles are continuous from block to block.

    Args:
        model: The body model.
        shape: The person's body measures.
        calibrations: Calibration of the filter's variances.
    """

    def __init__(
        self, model: BodyModel, shape: BodyShape, calibrations: VarianceCalibrations
    ) -> None:
        self._model = model
        no_limits = np.tile([-np.inf, np.inf], (ROOT_DOF, 1))
        self._body = OutputBody(
            model=model_arrays(model, shape.offsets),
            limits=np.concatenate([no_limits, np.asarray(model.limits, float)]),
            hinges=SegmentTree(model, shape).hinges,
            legs=np.array(
                [
                    index
                    for name, index in model.dof_index.items()
                    if without_side(model.link_of_dof.get(name, "")) in ("thigh", "shank")
                ]
            ),
            variance_calibration=coefficients_of(model, calibrations),
        )
        self._output_states = type_specialised(output_states)
        self._tracking_states = type_specialised(tracking_states)
        self._blending = make_blending(model.size)
        # The axial rotation of a straight limb may be unknown.
        self._must_be_known = np.array([not name.endswith("rotation") for name in model.dof_names])
        self._first_ns: int | None = None
        self._has_begun = False

    def estimates(self, block: StateBlock) -> EstimateBlock | None:
        """Convert states to estimates; at the start, those are left out that are too uncertain."""
        estimates = self._estimates(block)
        if self._has_begun:
            return estimates
        stddev = estimates.position_stddev[:, self._must_be_known].max(axis=1)
        if self._first_ns is None:
            self._first_ns = int(block.stamps_ns[0])
        is_due = block.stamps_ns - self._first_ns > START_NS
        known = np.flatnonzero((stddev <= START_STDDEV) | is_due)
        self._has_begun = len(known) > 0
        return estimates.rows(slice(int(known[0]), None)) if self._has_begun else None

    def _estimates(self, block: StateBlock) -> EstimateBlock:
        model, size, links = self._model, self._model.size, len(self._model.link_names)
        count = len(block.stamps_ns)
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
            fk_joints=np.empty((count, len(JOINTS), 3)),
            T_map_link=np.empty((count, links, 4, 4)),
        )
        stamps_ns, states = block.stamps_ns, block.states
        self._output_states(self._body, stamps_ns, states, self._blending, output)
        tracking_state = np.empty((count, len(JOINTS)), np.uint8)
        self._tracking_states(self._body.model, states, tracking_state)
        fields = output._asdict()
        # A smoothed covariance may be indefinite by rounding.
        stddev = np.sqrt(np.maximum(fields.pop("variance"), 0.0))
        stddev[:, ROOT_DOF:] = np.maximum(stddev[:, ROOT_DOF:], MIN_STDDEV)
        stddev[:, ROOT_POSITION:] = np.minimum(stddev[:, ROOT_POSITION:], MAX_STDDEV)
        return EstimateBlock(
            stamps_ns=stamps_ns,
            newest_ns=block.newest_ns,
            dof_names=model.dof_names,
            position_stddev=stddev,
            tracking_state=tracking_state,
            link_names=model.link_names,
            **fields,
        )
