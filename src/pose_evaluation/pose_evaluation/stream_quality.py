r"""Quality of a stream of joint angles as a robot's command.

A stream is continuous where the step from one message to the next is what both velocities say,

.. math:: |q_k - q_{k-1} - \tfrac{1}{2}(\dot q_k + \dot q_{k-1}) \Delta t| \le 3 \sigma_k
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.api import ROOT_DOF, BodyEstimate, BodyModel, FloatArray

TOLERANCE = 1e-6  # [rad] of a limit, which the URDF rounds
STEP = np.radians(10.0)  # [rad] that nobody may step beyond the velocity
SIGMAS = 3.0
START_S = 2.0  # [s] that count as the start
NS_PER_S = 1_000_000_000


@dataclass(frozen=True, kw_only=True)
class AngleStream:
    """n messages of one stream over d joint angles."""

    stamps_ns: NDArray[np.int64]  # (n,) [ns]
    arrivals_ns: NDArray[np.int64]  # (n,) [ns] when a subscriber heard each; the stamps if unknown
    position: FloatArray  # (n, d) [rad]
    velocity: FloatArray  # (n, d) [rad/s]
    stddev: FloatArray  # (n, d) [rad]; NaN unknown
    limits: FloatArray  # (d, 2) [rad] of the URDF


@dataclass(frozen=True, kw_only=True)
class StreamQuality:
    """Figures of one stream; counts are of messages in which any angle does so."""

    messages: int
    outside: int  # beyond the limits
    steps: int  # more than 10° beyond the published velocities
    steps_beyond_stddev: int  # more than 3 σ beyond the published velocities
    largest_step_deg: float  # [deg] beyond the published velocities
    largest_move_deg: float  # [deg] from one message to the next
    ahead: int  # stamped later than heard
    backwards: int  # stamped before the message before
    repeated: int  # stamped as the message before
    rate: float  # [Hz] mean
    interval_ms: tuple[float, float, float]  # [ms] 1st, 50th and 99th percentile
    start_chatter: float  # [-] RMS of the second difference in the first 2 s to the median of later


def stream_of(estimates: Iterable[BodyEstimate], model: BodyModel) -> AngleStream:
    """The joint angles of estimates, as ``joint_states`` has them.

    Raises:
        ValueError: If there are none.
    """
    rows = list(estimates)
    stamps_ns = np.array([each.stamp_ns for each in rows], np.int64)
    return AngleStream(
        stamps_ns=stamps_ns,
        arrivals_ns=stamps_ns,
        position=np.stack([each.position[ROOT_DOF:] for each in rows]),
        velocity=np.stack([each.velocity[ROOT_DOF:] for each in rows]),
        stddev=np.stack([each.position_stddev[ROOT_DOF:] for each in rows]),
        limits=np.asarray(model.limits, float),
    )


def unexplained_steps(stream: AngleStream) -> FloatArray:
    """Step of each angle less the mean velocity times the interval, (n − 1, d) [rad]."""
    dt = np.diff(stream.stamps_ns)[:, None] / NS_PER_S
    mean_velocity = 0.5 * (stream.velocity[1:] + stream.velocity[:-1])
    steps: FloatArray = np.abs(np.diff(stream.position, axis=0) - mean_velocity * dt)
    return steps


def measure_stream(stream: AngleStream) -> StreamQuality:
    """Judge a stream of two messages at least."""
    intervals_ns = np.diff(stream.stamps_ns)
    steps = unexplained_steps(stream)
    stddev = np.nan_to_num(stream.stddev[1:], nan=0.0)
    lower, upper = stream.limits.T
    outside = (stream.position < lower - TOLERANCE) | (stream.position > upper + TOLERANCE)
    low, middle, high = np.percentile(intervals_ns, [1.0, 50.0, 99.0]) * 1e-6
    return StreamQuality(
        messages=len(stream.stamps_ns),
        outside=_rows(outside),
        steps=_rows(steps > STEP),
        steps_beyond_stddev=_rows(steps > SIGMAS * stddev + TOLERANCE),
        largest_step_deg=float(np.degrees(steps.max())),
        largest_move_deg=float(np.degrees(np.abs(np.diff(stream.position, axis=0)).max())),
        ahead=int(np.sum(stream.stamps_ns > stream.arrivals_ns)),
        backwards=int(np.sum(intervals_ns < 0)),
        repeated=int(np.sum(intervals_ns == 0)),
        rate=float(len(intervals_ns) * NS_PER_S / max(intervals_ns.sum(), 1)),
        interval_ms=(float(low), float(middle), float(high)),
        start_chatter=_start_chatter(stream),
    )


def _rows(flags: NDArray[np.bool_]) -> int:
    return int(np.sum(flags.any(axis=1)))


def _start_chatter(stream: AngleStream) -> float:
    """RMS of the second difference in the first seconds, to the median over windows as long."""
    second = np.diff(stream.position, n=2, axis=0)
    since_s = (stream.stamps_ns[2:] - stream.stamps_ns[0]) / NS_PER_S
    windows = (since_s // START_S).astype(int)
    rms = [
        float(np.sqrt(np.mean(second[windows == each] ** 2)))
        for each in range(int(windows.max(initial=0)) + 1)
        if np.any(windows == each)
    ]
    if len(rms) < 2:
        return float("nan")
    return rms[0] / max(float(np.median(rms[1:])), 1e-12)
