r"""Quality of a stream of joint angles as a robot's command.

A stream is continuous if the step between messages agrees with both velocities,

.. math:: |q_k - q_{k-1} - \tfrac{1}{2}(\dot q_k + \dot q_{k-1}) \Delta t| \le 3 \sigma_k

After a silence the velocity is not used: there the whole step :math:`|q_k - q_{k-1}|` counts.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pose_core.api import ROOT_DOF, BodyEstimate, BodyModel, FloatArray
from pose_core.stamps import NS_PER_S
from pose_io.arrays import BoolArray, IntArray

TOLERANCE = 1e-9  # [rad] for rounding errors
STEP = np.radians(10.0)  # [rad] largest accepted step after a silence
SIGMAS = 3.0
SILENCE_NS = 100_000_000  # [ns] a longer interval is a silence
START_S = 2.0  # [s] duration of a start, also after a silence
MAX_CHATTER = 2.0  # [-] of the start
RATE_TOLERANCE = 0.02  # [-] of the rate


@dataclass(frozen=True, kw_only=True)
class AngleStream:
    """n messages of one stream over d joint angles."""

    stamps_ns: IntArray  # (n,) [ns]
    arrivals_ns: IntArray  # (n,) [ns] arrival at a subscriber; the stamps if unknown
    position: FloatArray  # (n, d) [rad]
    velocity: FloatArray  # (n, d) [rad/s]
    stddev: FloatArray  # (n, d) [rad]; NaN unknown
    limits: FloatArray  # (d, 2) [rad] of the URDF


@dataclass(frozen=True, kw_only=True)
class StreamQuality:
    """Figures of one stream; counts are of messages in which any angle meets the condition."""

    messages: int
    outside: int  # beyond the limits
    steps_beyond_stddev: int  # more than 3 σ beyond the published velocities
    largest_step_deg: float  # [deg] beyond the published velocities
    largest_move_deg: float  # [deg] from one message to the next
    step_after_silence_deg: float  # [deg] largest; NaN without a silence
    ahead: int  # stamped after their arrival
    backwards: int  # stamped before the previous message
    repeated: int  # stamped like the previous message
    rate: float  # [Hz] mean, without silences
    start_chatter: float
    """RMS of the second difference in the first 2 s of the stream, or after a silence, whichever is
    larger, relative to the median of the other intervals of 2 s [-]."""

    def broken(self, rate: float) -> tuple[str, ...]:
        """The requirements that the stream does not meet.

        Args:
            rate: Required rate [Hz].
        """
        holds = {
            "limits": self.outside == 0,
            "steps": self.steps_beyond_stddev == 0,
            "step after silence": not self.step_after_silence_deg > np.degrees(STEP),
            "calm start": not self.start_chatter > MAX_CHATTER,
            "stamps": self.ahead + self.backwards + self.repeated == 0,
            "rate": abs(self.rate - rate) <= RATE_TOLERANCE * rate,
        }
        return tuple(name for name, does in holds.items() if not does)


def stream_of(estimates: Iterable[BodyEstimate], model: BodyModel) -> AngleStream:
    """The joint angles of estimates, as in ``joint_states``.

    Raises:
        ValueError: If there are no estimates.
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


def measure_stream(stream: AngleStream) -> StreamQuality:
    """Compute the figures of a stream of at least two messages."""
    intervals_ns = np.diff(stream.stamps_ns)
    is_running = intervals_ns <= SILENCE_NS
    moves = np.diff(stream.position, axis=0)
    mean_velocity = 0.5 * (stream.velocity[1:] + stream.velocity[:-1])
    steps = np.abs(moves - mean_velocity * intervals_ns[:, None] / NS_PER_S)[is_running]
    moves = np.abs(moves)
    stddev = np.nan_to_num(stream.stddev[1:][is_running], nan=0.0)
    lower, upper = stream.limits.T
    outside = (stream.position < lower - TOLERANCE) | (stream.position > upper + TOLERANCE)
    running_ns = intervals_ns[is_running]
    return StreamQuality(
        messages=len(stream.stamps_ns),
        outside=_rows(outside),
        steps_beyond_stddev=_rows(steps > SIGMAS * stddev + TOLERANCE),
        largest_step_deg=float(np.degrees(steps.max(initial=0.0))),
        largest_move_deg=float(np.degrees(moves[is_running].max(initial=0.0))),
        step_after_silence_deg=(
            float("nan") if is_running.all() else float(np.degrees(moves[~is_running].max()))
        ),
        ahead=int(np.sum(stream.stamps_ns > stream.arrivals_ns)),
        backwards=int(np.sum(intervals_ns < 0)),
        repeated=int(np.sum(intervals_ns == 0)),
        rate=float(len(running_ns) * NS_PER_S / max(running_ns.sum(), 1)),
        start_chatter=_start_chatter(stream, is_running),
    )


def _rows(flags: BoolArray) -> int:
    return int(np.sum(flags.any(axis=1)))


def _start_chatter(stream: AngleStream, is_running: BoolArray) -> float:
    """Largest RMS of the second difference at a start, relative to the median elsewhere [-]."""
    starts: list[float] = []
    others: list[float] = []
    begins = [0, *(np.flatnonzero(~is_running) + 1).tolist(), len(stream.stamps_ns)]
    for begin, end in pairwise(begins):
        second = np.diff(stream.position[begin:end], n=2, axis=0)
        since_s = (stream.stamps_ns[begin + 2 : end] - stream.stamps_ns[begin]) / NS_PER_S
        windows = (since_s // START_S).astype(int)
        for each in np.unique(windows).tolist():
            rms = float(np.sqrt(np.mean(second[windows == each] ** 2)))
            (others if each else starts).append(rms)
    return max(starts) / max(float(np.median(others)), 1e-12) if others else float("nan")
