"""Simulated skeleton trackers on captured motion: offsets, hidden joints, delays, gross errors.

None of them equals the default estimator's measurement model: offsets rotate with the person and
drift; a hidden joint drifts by a decimetre and often still has the state TRACKED.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.special import ndtr

from pose_core.api import SkeletonSample
from pose_core.arrays import FloatArray
from pose_core.joints import TrackingState
from pose_io.arrays import ByteArray
from pose_sim.captured.azure import NEAREST, as_published, azure_joints
from pose_sim.captured.clip import RATE
from pose_sim.captured.clips import heading
from pose_sim.captured.residuals import resampled_residuals
from pose_sim.occlusion import hidden
from pose_sim.rotations import about_z
from pose_sim.tracker_errors import low_passed, slow_process

HEIGHT = 1.7  # [m] height of the body model for occlusions
DECISION_S = 0.5  # [s] for which a joint's tracking state is constant
SLOWEST_RATE = 15.0  # [Hz] of an uneven tracker at 30 Hz


@dataclass(frozen=True, kw_only=True)
class TrackerModel:
    """Parameters of a tracker; errors are standard deviations per axis."""

    constant_offset: float = 0.015  # [m] of each joint
    slow_offset: float = 0.012  # [m]
    slow_s: float = 5.0  # [s] time constant of it
    white: float = 0.006  # [m]
    hidden_error: float = 0.14  # [m] drift of a hidden joint
    hidden_s: float = 0.6  # [s] time constant of it
    hidden_called_tracked: float = 0.4  # [-] share of hidden joints with the state TRACKED
    has_confidence: bool = True  # otherwise every joint is TRACKED
    facing: float = 0.0  # [-] relative increase of the offsets from behind
    gross_share: float = 0.0  # [-] share of joints with errors of up to half a metre
    delay: float = 0.0  # [s]
    rate: float = 30.0  # [Hz]
    jitter: float = 0.002  # [s] of stamps
    smoothing: float = 0.0  # [s] time constant of the tracker's own filter
    slowest_rate: float = 0.0  # [Hz] lowest rate of temporary drops; 0: constant rate
    has_32_joints: bool = False  # Azure Kinect's joints, mapped to 15 by a joint map
    real_residuals: bool = False  # residuals of UI-PRMD instead of the offsets


TRACKERS = {
    "mixed": TrackerModel(),
    "late": TrackerModel(delay=0.06),
    "slow": TrackerModel(rate=15.0, constant_offset=0.012),
    "smoothing": TrackerModel(smoothing=0.05, slow_offset=0.018, slow_s=2.0, white=0.003),
    "calm": TrackerModel(
        constant_offset=0.01, slow_offset=0.01, hidden_error=0.08, hidden_called_tracked=0.2
    ),
    "unconfident": TrackerModel(has_confidence=False, hidden_error=0.10),
    "gross": TrackerModel(gross_share=0.03),
    "facing": TrackerModel(
        facing=1.5, constant_offset=0.012, slow_offset=0.015, hidden_called_tracked=0.7
    ),
    "azure": TrackerModel(
        has_32_joints=True, has_confidence=False, hidden_error=0.08, smoothing=0.02
    ),
    "uiprmd": TrackerModel(
        real_residuals=True,
        white=0.004,
        slow_offset=0.0,
        constant_offset=0.0,
        slowest_rate=SLOWEST_RATE,
    ),
    "uneven": TrackerModel(gross_share=0.01, hidden_called_tracked=0.8, slowest_rate=SLOWEST_RATE),
}
"""Tracker models by name."""
TUNING_TRACKERS = ("mixed", "late", "slow", "smoothing", "calm")
"""Tracker models on which tuning is allowed."""
HELD_OUT_TRACKERS = tuple(name for name in TRACKERS if name not in TUNING_TRACKERS)
"""Held-out tracker models, for evaluation."""


@dataclass(frozen=True, kw_only=True)
class TrackerFrames:
    """Frames of a tracker, n of them."""

    stamps_s: FloatArray  # (n,) [s]
    positions: FloatArray  # (n, 15, 3) [m] in the camera's optical frame
    tracking_state: ByteArray  # (n, 15)

    def sample(self, row: int, stamp_ns: int, sensor: str, person: str) -> SkeletonSample:
        """A frame as a sensor's sample of a person."""
        return SkeletonSample(
            stamp_ns=stamp_ns,
            sensor=sensor,
            person=person,
            positions=np.ascontiguousarray(self.positions[row]),
            tracking_state=self.tracking_state[row],
        )


def track(
    positions: FloatArray, T_map_camera: FloatArray, model: TrackerModel, rng: np.random.Generator
) -> TrackerFrames:
    """Simulate a tracker's measurements of a person.

    Args:
        positions: True joints in map at :data:`RATE`, (m, 15, 3) [m].
        T_map_camera: The camera's pose, (4, 4).
        model: The tracker's parameters.
        rng: Random generator.
    """
    times = np.arange(len(positions)) / RATE
    stamps = _stamps(times[-1], model, rng)
    smooth = low_passed(positions, model.smoothing, RATE) if model.smoothing else positions
    seen = at(stamps - model.delay, times, smooth)
    true = at(stamps - model.delay, times, positions)
    camera = T_map_camera[:3, 3]
    covered = hidden(true, camera, HEIGHT)
    covered = gaussian_filter1d(covered, 0.05 * model.rate, axis=0, mode="nearest")
    unseen = covered
    if model.has_32_joints:
        seen, unseen = azure_joints(seen), covered[:, NEAREST]
    shape = seen.shape
    size = model.hidden_error * rng.uniform(0.6, 1.4, (1, shape[1], 1))
    wander = size * unseen[..., None] * slow_process(shape, model.hidden_s, model.rate, rng)
    if model.real_residuals:
        offsets = resampled_residuals(true, len(stamps) / (stamps[-1] - stamps[0]), rng)
    else:
        offsets = _offsets(true, shape[1], camera, model, rng)
    noisy = seen + offsets + wander
    noisy += model.white * rng.standard_normal(shape)
    struck = rng.random(shape[:2]) < model.gross_share
    noisy += struck[..., None] * rng.uniform(-0.5, 0.5, shape)
    R, t = T_map_camera[:3, :3], T_map_camera[:3, 3]
    optical = (noisy - t) @ R
    if model.has_32_joints:
        optical = as_published(optical)
    state = _states(covered, model, rng)
    return TrackerFrames(stamps_s=stamps, positions=optical, tracking_state=state)


def _stamps(end_s: float, model: TrackerModel, rng: np.random.Generator) -> FloatArray:
    """Stamps of the frames up to the session's end [s]."""
    first = rng.uniform(0.0, 1.0 / model.rate) + model.delay + 0.05
    stamps = np.arange(first, end_s, 1.0 / model.rate)
    if model.slowest_rate:
        # An overloaded tracker skips frames for some time.
        busy = ndtr(slow_process(stamps.shape, 1.0, model.rate, rng))
        left_out = (busy > 0.6) & (rng.random(len(stamps)) > model.slowest_rate / model.rate)
        stamps = stamps[~left_out]
    return np.sort(stamps + model.jitter * rng.standard_normal(len(stamps)))


def _states(covered: FloatArray, model: TrackerModel, rng: np.random.Generator) -> ByteArray:
    """Tracking states of the joints, (n, 15)."""
    state = np.full(covered.shape, int(TrackingState.TRACKED), np.uint8)
    if model.has_confidence:
        opinion = ndtr(slow_process(covered.shape, DECISION_S, model.rate, rng))
        noticed = (covered > 0.5) & (opinion > model.hidden_called_tracked)
        state[noticed] = int(TrackingState.INFERRED)
    return state


def _offsets(
    true: FloatArray, joints: int, camera: FloatArray, model: TrackerModel, rng: np.random.Generator
) -> FloatArray:
    """Offsets of the joints in the body [m], rotated with its heading."""
    shape = len(true), joints, 3
    offset = model.constant_offset * rng.standard_normal((1, joints, 3))
    offset = offset + model.slow_offset * slow_process(shape, model.slow_s, model.rate, rng)
    R_map_body = about_z(heading(true))
    if model.facing:
        sight = (camera - true.mean(axis=1))[:, :2]
        facing = np.sum(R_map_body[:, :2, 0] * sight, axis=1) / np.linalg.norm(sight, axis=1)
        offset = offset * (1.0 + 0.5 * model.facing * (1.0 - facing))[:, None, None]
    return offset @ np.swapaxes(R_map_body, 1, 2)


def at(instants: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    """Linear interpolation of (m, …) values at n instants, (n, …)."""
    flat = values.reshape(len(values), -1)
    columns = [np.interp(instants, times, flat[:, i]) for i in range(flat.shape[1])]
    return np.stack(columns, axis=1).reshape(len(instants), *values.shape[1:])
