"""Runs the filter of li2020: starts it, updates it, and restarts it when it loses the person."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.baseline_filters.li2020 import Li2020Filter
from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.parameters import FusionParameters
from pose_core.stamps import NS_PER_S

DIVERGED_NS = NS_PER_S // 2
COUNTERS = (
    "frames_without_trunk",
    "filter_starts",
    "filter_restarts_gap",
    "filter_restarts_strayed",
    "filter_restarts_numerical",
)


def mean_of_sensors(measured: FloatArray) -> FloatArray:
    """Mean over the sensors that measure a joint, (sensors, 15, 3) to (15, 3) [m]; NaN if none."""
    seen = np.isfinite(measured)
    count = seen.sum(axis=0)
    total = np.where(seen, measured, 0.0).sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


class KinectTracker:
    """Tracks one person from the joint positions of the sensors.

    Args:
        model: The body model.
        shape: The person's body measures.
        parameters: Parameters of the filter and of its restarts.
        counters: Counts restarts by reason; declares :data:`COUNTERS`.
    """

    def __init__(
        self,
        model: BodyModel,
        shape: BodyShape,
        parameters: FusionParameters,
        counters: Counters,
    ) -> None:
        self.filter = Li2020Filter(model, shape, parameters)
        self._parameters = parameters
        self._counters = counters
        self._last_ns: int | None = None
        self._diverged_since_ns: int | None = None

    def update(self, stamp_ns: int, measured: FloatArray) -> bool:
        """Update the filter with the measurements of one instant.

        Args:
            stamp_ns: The instant.
            measured: Joints of each sensor in map, shape (sensors, 15, 3) [m]; NaN if unseen.

        Returns:
            Whether the filter has a pose.
        """
        if self._last_ns is not None:
            dt_ns = stamp_ns - self._last_ns
            if not 0 < dt_ns <= self._parameters.restart_after * NS_PER_S:
                self._counters.add("filter_restarts_gap")
                self._forget()
        if self._last_ns is None:
            return self._start(stamp_ns, measured)
        try:
            innovation = self.filter.step((stamp_ns - self._last_ns) / NS_PER_S, measured)
        except np.linalg.LinAlgError:
            self._counters.add("filter_restarts_numerical")
            return self._start(stamp_ns, measured)
        self._last_ns = stamp_ns
        if self._has_diverged(stamp_ns, innovation):
            self._counters.add("filter_restarts_strayed")
            return self._start(stamp_ns, measured)
        return True

    def _start(self, stamp_ns: int, measured: FloatArray) -> bool:
        self._forget()
        if not self.filter.start(mean_of_sensors(measured)):
            self._counters.add("frames_without_trunk")
            return False
        self._counters.add("filter_starts")
        self._last_ns = stamp_ns
        return True

    def _has_diverged(self, stamp_ns: int, innovation: FloatArray) -> bool:
        """Whether the filter has lost the person for too long."""
        seen = innovation[np.isfinite(innovation)]
        if len(seen) == 0 or np.median(seen) < self._parameters.restart_distance:
            self._diverged_since_ns = None
            return False
        if self._diverged_since_ns is None:
            self._diverged_since_ns = stamp_ns
        return stamp_ns - self._diverged_since_ns >= DIVERGED_NS

    def _forget(self) -> None:
        self._last_ns = None
        self._diverged_since_ns = None
