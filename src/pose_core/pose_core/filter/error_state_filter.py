"""The default filter of one body: its state, and the compiled steps that change it."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.inverse_kinematics import dof_from_positions
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import BodyModel
from pose_core.body.segment_tree import SegmentTree
from pose_core.body.shape import BodyShape
from pose_core.body.trunk import trunk_axes
from pose_core.filter.constants import make_constants
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import NO_IMUS, ImuFrame
from pose_core.filter.interpolated import interpolate_published
from pose_core.filter.layout import make_layout
from pose_core.filter.motion import predict
from pose_core.filter.published import predict_published
from pose_core.filter.state import FilterState, Pose, start_state
from pose_core.filter.step import StepResult, update_with_frame, update_with_imus
from pose_core.filter.tracker_errors import combined_delay
from pose_core.filter.tuning import FilterTuning
from pose_core.joints import JOINTS
from pose_core.kernels.compiling import type_specialised
from pose_core.kernels.joint_kinematics import compute_joints
from pose_core.kernels.left_right_swaps import undo_swaps
from pose_core.kernels.published_state import PublishedState


class ErrorStateFilter:
    """Predict, then update with IMUs, then with each camera's frame.

    Args:
        model: The body model.
        shape: The person's body measures.
        sensors: Number of cameras.
        tuning: The filter's parameters.
        tracker_delay_s: Prior mean of the trackers' delays [s].
    """

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        sensors: int,
        tuning: FilterTuning,
        tracker_delay_s: float,
    ) -> None:
        self._model, self._shape, self._tuning = model, shape, tuning
        self._tree = SegmentTree(model, shape)
        self._constants = make_constants(self._tree, tuning, tracker_delay_s)
        self.layout = make_layout(len(self._tree.parents), len(self._tree.sliding_links))
        self.state: FilterState | None = None
        """None before the start, and after a result that is not finite."""
        self.delays_s = np.full(sensors, self._constants.tracker_errors.known_delay_s)
        """Estimated delay of each camera's tracker, (sensors,) [s]; a new start keeps it."""
        self.predicted_from: tuple[float, Pose] | None = None
        """Time of the last prediction [s], and the pose before it: what is interpolated from."""
        self._delay_sums = np.zeros((sensors, len(self._tree.parents), 2))
        self._imus = NO_IMUS  # at the state's instant
        self._predict = type_specialised(predict)
        self._update_with_imus = type_specialised(update_with_imus)
        self._update_with_frame = type_specialised(update_with_frame)
        self._predict_published = type_specialised(predict_published)
        self._interpolate_published = type_specialised(interpolate_published)
        self._undo_swaps = type_specialised(undo_swaps)
        self._compute_joints = type_specialised(compute_joints)

    @property
    def measured_delays_s(self) -> FloatArray:
        """Each tracker's delay by the last seconds and its deviation, (2, sensors) [s], unbounded.

        A negative one means that the IMUs' samples are late.
        """
        constants = self._constants.tracker_errors
        return np.array([combined_delay(constants, sums) for sums in self._delay_sums]).T

    def start(self, joints: FloatArray) -> bool:
        """Start at rest at measured joints, (15, 3) [m]; False if the trunk is not visible."""
        if not np.all(np.isfinite(trunk_axes(joints))):
            return False
        kinematics = ForwardKinematics(self._model, self._shape.offsets, trunk_axes(joints))
        dof = dof_from_positions(self._model, joints)
        state = start_state(
            self.layout,
            len(self.delays_s),
            self._tuning,
            self._constants.motion.slide_variance,
            dof[:3],
            kinematics.pose(dof).rotations,
        )
        self.state = state._replace(
            views=state.views._replace(delay=self.delays_s, delay_sums=self._delay_sums)
        )
        self._imus = NO_IMUS
        return True

    def go_back(self, state: FilterState) -> None:
        """Go back to an earlier state, which the filter keeps."""
        np.copyto(self.delays_s, state.views.delay)
        np.copyto(self._delay_sums, state.views.delay_sums)
        self.state = state._replace(
            views=state.views._replace(delay=self.delays_s, delay_sums=self._delay_sums)
        )

    def predict(self, dt_s: float) -> None:
        """Advance the state by ``dt_s`` [s]."""
        assert self.state is not None
        self.predicted_from = dt_s, Pose(*(each.copy() for each in self.state.pose))
        self._predict(self._constants.motion, self.state, dt_s)

    def update_with_imus(self, imus: ImuFrame, information: FloatArray) -> bool:
        """Update with aligned IMUs' samples at the state's instant; whether this succeeded.

        See :func:`pose_core.filter.step.update_with_imus`.
        """
        assert self.state is not None
        self._imus = imus
        if not len(imus.links):
            self.state.imus.is_used[:] = False
        elif not self._update_with_imus(self._constants, self.state, imus, information):
            self.state = None
        return self.state is not None

    def update_with_frame(self, frame: CameraFrame, information: FloatArray) -> StepResult:
        """Update with a camera's frame; see :func:`pose_core.filter.step.update_with_frame`."""
        assert self.state is not None
        fields = self._update_with_frame(self._constants, self.state, frame, information)
        result = StepResult(*fields)
        if not result.is_finite:
            self.state = None
        return result

    def undo_swaps(self, frame: CameraFrame) -> tuple[CameraFrame, int]:
        """Correct left/right swaps of a frame's tracker; the frame, and the number of swaps."""
        assert self.state is not None
        pose, body = self.state.pose, self._constants.camera.body
        levers, joints = np.zeros((len(JOINTS), self.layout.links, 3)), np.empty((len(JOINTS), 3))
        self._compute_joints(body, pose.position, pose.rotations, pose.slides, levers, joints)
        order = np.arange(len(JOINTS))
        swaps = self._undo_swaps(frame.positions, joints, self._constants.swaps, order)
        if swaps:
            frame = frame._replace(
                positions=frame.positions[order], tracking_state=frame.tracking_state[order]
            )
        return frame, swaps

    def published(
        self,
        state: FilterState,
        information: FloatArray,
        scale: float,
        ahead_s: float = 0.0,
        imus: ImuFrame = NO_IMUS,
    ) -> PublishedState:
        """The published part of a state, at its instant or at a later one.

        Args:
            state: The filter's state, or a smoothed one.
            information: Of the last updates, (2, links, 3, 3) [1/rad²]: by cameras, by IMUs.
            scale: Factor of the variances [-].
            ahead_s: Time since the state's instant [s].
            imus: Samples of the aligned IMUs at the later instant.
        """
        published = self._make_published((), information, np.array([scale]))
        self._predict_published(self._constants, state, ahead_s, self._imus, imus, published)
        return published

    def interpolated(
        self, ages_s: FloatArray, information: FloatArray, scale: float
    ) -> PublishedState | None:
        """The published part at n instants since the state before the last prediction.

        Args:
            ages_s: How long before the state's instant, (n,) [s].
            information: As in :meth:`published`.
            scale: As in :meth:`published`.

        Returns:
            n rows; None without two states.
        """
        if self.state is None or self.predicted_from is None:
            return None
        interval_s, before = self.predicted_from
        count = len(ages_s)
        repeated = np.empty((count, *information.shape))
        repeated[:] = information
        published = self._make_published((count,), repeated, np.full((count, 1), scale))
        shares = np.minimum(np.maximum(1.0 - ages_s / interval_s, 0.0), 1.0)
        self._interpolate_published(
            self._constants, before, self.state, interval_s, shares, published
        )
        return published

    def _make_published(
        self, rows: tuple[int, ...], information: FloatArray, scale: FloatArray
    ) -> PublishedState:
        """Allocate published states."""
        links = self.layout.links
        return PublishedState(
            position=np.empty((*rows, 3)),
            velocity=np.empty((*rows, 3)),
            rotations=np.empty((*rows, links, 3, 3)),
            rates=np.empty((*rows, links, 3)),
            joints=np.empty((*rows, len(JOINTS), 3)),
            position_variance=np.empty((*rows, 3)),
            covariance=np.empty((*rows, links, 3, 3)),
            information=information,
            scale=scale,
            ahead_s=np.zeros((*rows, 1)),
        )
