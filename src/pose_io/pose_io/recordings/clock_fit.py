r"""Mapping of a sensor's clock onto the host's.

The frame captured at the sensor's time :math:`s_i` arrives at the host's time

.. math:: h_i = s_i\,(1 + k) + b + d_i, \qquad d_i \ge 0                                  \tag{1}

with the offset :math:`b`, the drift :math:`k` and a delay that is never negative: transmission,
waiting for the host's next tick, and queueing, which may grow to seconds and shrink again. As
delays are one-sided, a mean or median is biased; the line follows from the fastest frames:

.. math:: \min_{b, k} \sum_i d_i \quad\text{subject to}\quad d_i \ge 0,\; |k| \le k_{\max} \tag{2}

which :func:`pose_core.lower_line.line_below` solves, with the drift bounded by crystals' tolerance.
The capture stamp is :math:`h_i - d_i`; a delay common to all frames is part of :math:`b` and cannot
be observed.

A clock that is reset or set, the sensor's or the host's, begins a new epoch: a jump of
:math:`h - s` larger than any queueing delay. Each epoch has a line of its own.
"""

from dataclasses import dataclass

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.lower_line import line_below
from pose_io.arrays import IntArray

MAX_DRIFT = 200e-6  # [-] two crystals of 100 ppm with opposite errors
JUMP_NS = 5_000_000_000  # [ns] queues of 2 s occur in real recordings
SUPPORT = 3  # [-] frames required near the line, else its lowest frame is an outlier
SUPPORT_NS = 50_000_000  # [ns] distance that counts as near: one and a half frames at 30 Hz
MAX_OUTLIERS = 0.05  # [-] share of an epoch's frames


@dataclass(frozen=True, kw_only=True)
class ClockFit:
    """Capture stamps on the host's clock, with the parameters of the fit."""

    capture_ns: IntArray  # (m,) [ns] on the host's clock
    delay_ns: IntArray  # (m,) [ns] d of (1); negative for outliers alone
    epoch: IntArray  # (m,) the epoch of each frame, in order of appearance from 0
    drift: FloatArray  # (epochs,) [-] k of (1)
    outliers: int  # frames that arrived before the line, left out of (2)

    def summary(self) -> dict[str, object]:
        """Summary of the fit for reports."""
        longest = int(np.bincount(self.epoch).argmax())
        median, late, latest = np.quantile(self.delay_ns * 1e-6, [0.5, 0.95, 1.0])
        return {
            "clock_epochs": len(self.drift),
            "clock_drift_ppm": round(float(self.drift[longest]) * 1e6, 1),
            "clock_delay_median_ms": round(float(median), 1),
            "clock_delay_95_ms": round(float(late), 1),
            "clock_delay_max_ms": round(float(latest), 1),
            "clock_outliers": self.outliers,
        }


def fit_clock(sensor_ns: IntArray, host_ns: IntArray) -> ClockFit:
    """Map a sensor's clock onto the host's.

    Args:
        sensor_ns: Capture on the sensor's clock [ns], shape (m,), in order of arrival.
        host_ns: Arrival on the host's clock [ns], shape (m,).
    """
    epoch = _epochs(host_ns - sensor_ns)
    capture_ns = np.empty_like(host_ns)
    drift = np.zeros(epoch.max(initial=-1) + 1)
    outliers = 0
    for number in range(len(drift)):
        members = np.flatnonzero(epoch == number)
        offset = host_ns[members] - sensor_ns[members]
        since = sensor_ns[members] - sensor_ns[members[0]]
        # Relative to the first frame: a double holds that to the nanosecond.
        delay_ns, drift[number], dropped = _fit_line(since, offset - offset[0])
        capture_ns[members] = host_ns[members] - delay_ns
        outliers += dropped
    return ClockFit(
        capture_ns=capture_ns,
        delay_ns=host_ns - capture_ns,
        epoch=epoch,
        drift=drift,
        outliers=outliers,
    )


def _epochs(offset_ns: IntArray) -> IntArray:
    """Number the epochs; an epoch interrupted by a glitch continues after it."""
    epoch = np.empty(len(offset_ns), dtype=np.int64)
    latest: list[int] = []  # each epoch's last offset
    for i, offset in enumerate(offset_ns.tolist()):
        for number in reversed(range(len(latest))):
            if abs(offset - latest[number]) <= JUMP_NS:
                break
        else:
            number = len(latest)
            latest.append(offset)
        latest[number] = offset
        epoch[i] = number
    return epoch


def _fit_line(since_ns: IntArray, offset_ns: IntArray) -> tuple[IntArray, float, int]:
    """Solve (2) for one epoch, leaving out frames that lie alone below all others.

    Returns:
        Delays [ns], drift [-] and the number of outliers.
    """
    kept = np.ones(len(since_ns), dtype=bool)
    while True:
        points = sorted(zip(since_ns[kept].tolist(), offset_ns[kept].tolist(), strict=True))
        line = line_below(points, MAX_DRIFT)
        above = np.rint(line.skew * (since_ns - line.origin_ns)).astype(np.int64)
        delay_ns = offset_ns - line.offset_ns - above
        near = kept & (delay_ns <= SUPPORT_NS)
        enough = near.sum() >= min(SUPPORT, kept.sum())
        if enough or len(kept) - kept.sum() + near.sum() > MAX_OUTLIERS * len(kept):
            return delay_ns, line.skew, int(len(kept) - kept.sum())
        kept &= ~near
