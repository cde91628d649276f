"""The published part of the default filter's states: which sources count, and their variances."""

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.estimators.variance_scale import CONSISTENT_NIS, updated_mean_nis, variance_scale
from pose_core.filter.depth_errors import depth_variance_scale
from pose_core.filter.error_state_filter import ErrorStateFilter
from pose_core.filter.imu import NO_IMUS, ImuFrame
from pose_core.filter.layout import rotation_column
from pose_core.filter.state import FilterState
from pose_core.kernels.published_state import CAMERAS, IMUS, PublishedState

SILENT_S = 0.2  # [s] after its last frame, a camera is no source of the published pose
KNOWN_STDDEV = np.radians(45.0)  # [rad] of a link's rotation that is known rather than guessed
MIN_KNOWN_SHARE = 1.0 / 3.0  # [-] of the links


class FilterOutput:
    """Publishes states with the information of the last updates and the scale of the variances.

    Args:
        error_state: The filter.
    """

    def __init__(self, error_state: ErrorStateFilter) -> None:
        self._filter = error_state
        self._mean_nis = CONSISTENT_NIS
        self.information = self.no_information()
        """Of the last update with each source, (2, links, 3, 3) [1/rad²]."""

    def no_information(self) -> FloatArray:
        """Zeros for the information of an update, (2, links, 3, 3) [1/rad²]."""
        return np.zeros((2, self._filter.layout.links, 3, 3))

    def add_nis(self, dt_s: float, nis: float) -> None:
        """Add the mean NIS [-] of an update, ``dt_s`` [s] after the last; NaN: no joint."""
        self._mean_nis = updated_mean_nis(self._mean_nis, dt_s, nis)

    def published(
        self,
        state: FilterState,
        information: FloatArray,
        ahead_s: float = 0.0,
        imus: ImuFrame = NO_IMUS,
    ) -> PublishedState:
        """The published part of a state advanced by ``ahead_s`` [s], to the IMUs' instant."""
        scale = self._variance_scale(state)
        return self._filter.published(state, information, scale, ahead_s, imus)

    def predicted(self, state: FilterState, ahead_s: float, imus: ImuFrame) -> PublishedState:
        """The state ``ahead_s`` [s] later, by the last updates and the IMUs' samples."""
        information = self._last_information(state, ahead_s, imus.links)
        return self.published(state, information, ahead_s, imus)

    def interpolated(self, state: FilterState, ages_s: FloatArray) -> PublishedState | None:
        """States between the last two observations, ``ages_s`` [s] before the last, (n,)."""
        information = self._last_information(state, 0.0, state.imus.is_used)
        return self._filter.interpolated(ages_s, information, self._variance_scale(state))

    def _last_information(
        self, state: FilterState, ahead_s: float, links: NDArray[np.int64] | NDArray[np.bool_]
    ) -> FloatArray:
        """Information of the last updates: cameras that still send, IMUs of these links."""
        information = self.no_information()
        if min(state.views.silent_s.tolist()) + ahead_s < SILENT_S:
            information[CAMERAS] = self.information[CAMERAS]
        information[IMUS, links] = self.information[IMUS, links]
        return information

    def _variance_scale(self, state: FilterState) -> float:
        """Factor [-] of the variances that are published."""
        by_depth = depth_variance_scale(state.views.depth_error_power, state.views.depth_noise)
        return float(variance_scale(self._mean_nis) * by_depth)


def knows_enough_links(state: FilterState) -> bool:
    """Whether enough links' rotations are known without a camera, rather than guessed."""
    first, after = rotation_column(0), rotation_column(len(state.pose.rotations))
    variances = np.diagonal(state.P)[first:after].reshape(-1, 3).sum(axis=1)
    return bool(np.mean(variances < KNOWN_STDDEV**2) > MIN_KNOWN_SHARE)
