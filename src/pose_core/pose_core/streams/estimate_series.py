"""Estimates with uncertainty and provenance over time, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pose_core.arrays import FloatArray

GIVEN = ("position", "position_stddev", "weight_kinect", "weight_imu")
"""What estimates and messages give under the same names."""


@dataclass(frozen=True, kw_only=True)
class EstimateSeries:
    """Estimates with uncertainty and provenance."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    names: tuple[str, ...]  # (k,) the degrees of freedom
    position: FloatArray  # (n, k) [m] or [rad]
    position_stddev: FloatArray  # (n, k) [m] or [rad]
    weight_kinect: FloatArray  # (n, k) [-] 0..1
    weight_imu: FloatArray  # (n, k) [-] 0..1
    source: NDArray[np.uint8]  # (n, k) sources: 0 predicted, 1 Kinect, 2 IMU, 3 both
    latency_s: FloatArray  # (n,) [s]


def estimate_series(
    estimates: Sequence[Any],
    names: Sequence[str],
    *,
    stamps_ns: Sequence[int],
    sources: Sequence[ArrayLike],
    latencies_s: Sequence[float],
) -> EstimateSeries:
    """Collect estimates, or the messages that carry them.

    Args:
        estimates: With ``position`` and so on, each of the degrees of freedom.
        names: Those, k of them.
        stamps_ns: One each [ns].
        sources: Where each degree of freedom came from; k each.
        latencies_s: One each [s].
    """

    def table(rows: Sequence[ArrayLike], kind: type) -> NDArray[Any]:
        return np.array(rows, kind).reshape(len(estimates), len(names))

    return EstimateSeries(
        stamps_ns=np.array(stamps_ns, np.int64),
        names=tuple(names),
        **{name: table([getattr(each, name) for each in estimates], float) for name in GIVEN},
        source=table(sources, np.uint8),
        latency_s=np.array(latencies_s, float),
    )
