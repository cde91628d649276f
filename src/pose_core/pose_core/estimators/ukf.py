"""``ukf``: the default filter's models, carried by sigma points instead of derivatives."""

from importlib.util import find_spec
from typing import Any

from pose_core.errors import ParameterError
from pose_core.estimators.default import DefaultEstimator
from pose_core.filter.camera import CameraFrame
from pose_core.filter.constants import FilterConstants
from pose_core.filter.imu import ImuReadings
from pose_core.filter.motion import MotionConstants
from pose_core.filter.sigma_points import (
    Scratch,
    SigmaWeights,
    predict_by_points,
    update_with_frame_by_points,
    update_with_imus_by_points,
)
from pose_core.filter.state import FilterState
from pose_core.filter.step import StepResult
from pose_core.fusion.parameters import FusionParameters
from pose_core.kernels.compiling import type_specialised
from pose_core.streams.samples import FloatArray

ALPHA = 0.1  # [-] spread of the points in units of √n standard deviations
BETA = 2.0  # [-] best for a Gaussian


class UkfEstimator(DefaultEstimator):
    """Unscented filter on the manifold; state, models and robust weights are the default's."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._weights: dict[int, SigmaWeights] = {}
        self._scratch: Scratch | None = None
        self._predict_by_points = type_specialised(predict_by_points)
        self._take_imus_by_points = type_specialised(update_with_imus_by_points)
        self._update_with_frame_by_points = type_specialised(update_with_frame_by_points)
        self._predict, self._update_with_imus, self._update_with_frame = (
            self._go_on,
            self._imus,
            self._frame_by_points,
        )

    @classmethod
    def check(cls, parameters: FusionParameters) -> None:
        """The library that has the sigma points' weights must be installed."""
        del parameters
        if find_spec("filterpy") is None:
            raise ParameterError(
                "estimator = ukf needs the library filterpy, which is not installed: "
                "pip install 'pose_core[li2020]'"
            )

    def _go_on(self, constants: MotionConstants, state: FilterState, dt_s: float) -> None:
        scratch, weights = self._room(state)
        self._predict_by_points(constants, state, scratch, weights, dt_s)

    def _imus(
        self,
        constants: FilterConstants,
        state: FilterState,
        readings: ImuReadings,
        information: FloatArray,
    ) -> bool:
        scratch, weights = self._room(state)
        return self._take_imus_by_points(constants, state, scratch, weights, readings, information)

    def _frame_by_points(
        self,
        constants: FilterConstants,
        state: FilterState,
        frame: CameraFrame,
        information: FloatArray,
    ) -> StepResult:
        scratch, weights = self._room(state)
        return self._update_with_frame_by_points(
            constants, state, scratch, weights, frame, information
        )

    def _room(self, state: FilterState) -> tuple[Scratch, SigmaWeights]:
        """Room for points, and the weights of as many as the state asks for."""
        if self._scratch is None:
            self._scratch = Scratch(point=state.copy(), centre=state.copy())
        size = len(state.P)
        if size not in self._weights:
            self._weights[size] = sigma_weights(size)
        return self._scratch, self._weights[size]


def sigma_weights(size: int) -> SigmaWeights:
    """Filterpy's weights of the points of an error of ``size``."""
    # Loads all of scipy.stats for a second, which only this filter's users should wait for.
    from filterpy.kalman import MerweScaledSigmaPoints

    points = MerweScaledSigmaPoints(size, ALPHA, BETA, 0.0)
    return SigmaWeights(
        centre_mean=float(points.Wm[0]),
        centre_covariance=float(points.Wc[0]),
        other=float(points.Wm[1]),
        spread=ALPHA**2 * size,
    )
