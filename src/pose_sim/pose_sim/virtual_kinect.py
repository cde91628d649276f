"""A virtual Kinect: simulated skeletons of a depth camera's tracker.

An error has a constant part (offset of the joint in the body), a slow part that increases with
speed and occlusion, white noise, and short gross errors. The sizes are in
:mod:`pose_sim.kinect_noise`.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from pose_core.arrays import FloatArray, rows_of
from pose_core.joints import JOINTS, TrackingState
from pose_core.stamps import NS_PER_S
from pose_io.arrays import ByteArray, IntArray
from pose_sim import tracker_errors as errors
from pose_sim.kinect_noise import KinectParameters
from pose_sim.motion import Motion
from pose_sim.occlusion import hidden

FIELD_OF_VIEW = (np.radians(70.6), np.radians(60.0))  # [rad] Kinect v2 depth camera, wide and high
DECISION_TIME = 0.4  # [s] for which a joint's tracking state is constant


@dataclass(frozen=True, kw_only=True)
class KinectFrames:
    """Frames of one virtual Kinect: n frames of one person."""

    capture_s: FloatArray  # (n,) [s] true time of capture on the host's clock
    host_time_ns: IntArray  # (n,) [ns] arrival at the host
    sensor_time_ns: IntArray  # (n,) [ns] capture on the sensor's clock
    positions: FloatArray  # (n, 15, 3) [m] in the optical frame; NaN where not tracked
    tracking_state: ByteArray  # (n, 15)

    def late(self, offset_ns: int, after_ns: int) -> "KinectFrames":
        """Frames of a host whose clock is ``offset_ns`` [ns] ahead, after a time [ns] of it."""
        host_ns = self.host_time_ns + offset_ns
        return rows_of(replace(self, host_time_ns=host_ns), host_ns > after_ns)


def observe(
    motion: Motion,
    T_map_optical: FloatArray,
    parameters: KinectParameters,
    *,
    body_height: float,
    body_bias: FloatArray,
    common_lags: FloatArray,
    rng: np.random.Generator,
) -> KinectFrames:
    """Simulate a Kinect's measurements of a motion.

    Args:
        motion: The subject's motion.
        T_map_optical: The sensor's pose, shape (4, 4).
        parameters: Rates, delays and errors.
        body_height: The subject's height [m].
        body_bias: Part of the joints' constant offsets common to all sensors, standard normal
            variates, shape (15, 3, 4); see :func:`draw_body_bias`.
        common_lags: The same for the joints' delays, uniform from -0.5 to 0.5, shape (15,).
        rng: Random generator.
    """
    times, host_ns, sensor_ns = _clocks(float(motion.times[-1]), parameters, rng)
    truth = motion.joints_at(times)
    camera = T_map_optical[:3, 3]
    seen = _optical(truth, T_map_optical)
    blocked = np.maximum(hidden(truth, camera, body_height), _out_of_view(seen))
    blocked = errors.attention(blocked, parameters)
    pointing = errors.attention(errors.foreshortening(truth, camera), parameters)
    velocity = np.gradient(truth, times, axis=0)
    estimate = errors.tracked(truth, velocity, blocked, pointing, parameters, common_lags, rng)
    estimate += errors.offsets(truth, camera, parameters, body_bias, rng)
    wrong = errors.wander(velocity, blocked, pointing, parameters, rng)
    wrong += errors.glitches(velocity, parameters, rng)
    estimate += errors.with_stiff_bones(wrong, truth, parameters)
    positions = _optical(estimate, T_map_optical) + errors.white_noise(seen, parameters, rng)
    state = _states(blocked, parameters, rng)
    positions[state == TrackingState.NOT_TRACKED] = np.nan
    return KinectFrames(
        capture_s=times,
        host_time_ns=host_ns,
        sensor_time_ns=sensor_ns,
        positions=positions,
        tracking_state=state,
    )


def draw_body_bias(rng: np.random.Generator) -> FloatArray:
    """Draw the errors that all sensors of a kind have in common for one body, shape (15, 3, 4).

    The first column is the offset of a joint in the neutral pose, the others its dependence on the
    limb's direction.
    """
    return rng.standard_normal((len(JOINTS), 3, 4))


def _clocks(
    duration: float, p: KinectParameters, rng: np.random.Generator
) -> tuple[FloatArray, IntArray, IntArray]:
    """Capture [s], arrival [ns] and sensor clock [ns] of the frames that arrive."""
    period = 1.0 / p.frame_rate
    phase, boot = rng.uniform(0.0, period), rng.uniform(10.0, 5000.0)  # [s]
    drift = 1e-6 * p.clock_drift * rng.standard_normal()
    count = int((duration - phase) / (period * (1.0 - drift))) + 1
    sensor = boot + period * np.arange(count)  # regular on the sensor's own clock
    capture = (phase + (sensor - boot) * (1.0 - drift)).astype(np.float64)
    capture = capture[capture <= duration]
    sensor = sensor[: len(capture)]
    arrival = capture + p.latency + rng.exponential(1.0, len(capture)) * p.arrival_jitter
    arrival_ns = np.round(arrival * NS_PER_S).astype(np.int64)
    steps = np.arange(len(capture))
    arrival_ns = np.maximum.accumulate(arrival_ns - steps) + steps  # in order, never simultaneous
    kept = rng.random(len(capture)) >= p.dropped_share
    sensor_ns = np.round(sensor * NS_PER_S).astype(np.int64)
    return capture[kept], arrival_ns[kept], sensor_ns[kept]


def _optical(points: FloatArray, T_map_optical: FloatArray) -> FloatArray:
    return (points - T_map_optical[:3, 3]) @ T_map_optical[:3, :3]


def _out_of_view(optical: FloatArray) -> FloatArray:
    depth = np.maximum(optical[..., 2:], 1e-3)
    reach = np.tan(0.5 * np.array(FIELD_OF_VIEW)) * depth
    return (np.abs(optical[..., :2]) > reach).any(axis=-1).astype(float)


def _states(blocked: FloatArray, p: KinectParameters, rng: np.random.Generator) -> ByteArray:
    """Tracking state of each joint, which changes rarely, (n, 15)."""
    believes = ndtr(errors.slow_process(blocked.shape, DECISION_TIME, p.frame_rate, rng))
    loses = ndtr(errors.slow_process(blocked.shape, DECISION_TIME, p.frame_rate, rng))
    is_hidden = blocked > 0.5
    state = np.full(blocked.shape, TrackingState.TRACKED, dtype=np.uint8)
    state[is_hidden & (believes >= p.wrongly_tracked)] = TrackingState.INFERRED
    share = np.where(is_hidden, p.hidden_lost_share, p.lost_share)
    state[loses < share] = TrackingState.NOT_TRACKED
    return state
