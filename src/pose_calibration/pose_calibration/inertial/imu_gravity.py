r"""The vertical in the reference sensor's frame, from IMUs on limbs that it tracks.

With :math:`u` the vertical and :math:`b` a bone's direction in the camera's frame, and :math:`g`
the vertical and :math:`a` the same bone in the IMU's, for all instants

.. math:: (u + e) \cdot b(t) + c = a \cdot g(t)

where :math:`c` is the tracker's constant bias of that limb's inclination, and :math:`e` the part
of the bias that changes with the limb's direction, the same in all sensors. There is one :math:`u`,
one :math:`e` per limb, and one :math:`a` and :math:`c` per limb and view. They are estimated by
Gauss-Newton with Tukey's weights and priors on :math:`u`, from the person's upright stance, on
:math:`c` and on :math:`e`. Headings and alignments of the IMUs are not needed, but several limbs
must change their inclination. The estimates without one segment each tell how well the limbs agree
(jackknife): where few limbs tell, or trackers err in the same way for long, that is the larger part
of the uncertainty, and the result stays nearer to the prior. A person may hold a posture out of
balance for long: where all limbs together contradict the prior, it is left out.

References:
    Efron, Stein (1981), Annals of Statistics 9(3): the jackknife's variance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pose_calibration.clocks.joint_delays import CORRELATION_S
from pose_calibration.clocks.motion_track import Track
from pose_calibration.floor.gravity import Gravity
from pose_calibration.geometry.rigid_transform import TUKEY
from pose_calibration.inertial.imu_motion import Views, limb_ends
from pose_core.api import FloatArray
from pose_core.arrays import unit_vectors
from pose_core.finite_numbers import are_known, robust_stddev

BODY_IMUS = "body-worn IMUs"
RATE = 10.0  # [Hz] of the instants used
MIN_SAMPLES = 50  # [-] of a limb
MIN_SEGMENTS = 2  # [-]
ITERATIONS = 15
FLOOR_STDDEV = np.radians(0.5)  # [rad] of the IMUs' own inclination, a lower bound
LIMB_STDDEV = 0.05  # [-] of a limb's constant bias: 1.5 cm of 30 cm
LIMB_SLOPE_STDDEV = 0.08  # [-] of the part that changes with its direction: 1.7 cm at either end
OPTIMISM = 2.0  # [-] true over formal errors: a limb's errors are correlated
REJECTED_STDDEV = np.radians(15.0)  # [rad] of an estimate without IMUs, to see whether it holds
REJECTED_FROM = 4.0  # [-] standard deviations, from which on it does not
SEARCHED_STDDEV = np.radians(20.0)  # [rad] of a vertical that a search has found
SEARCH_ITERATIONS = 3
IMUS_COUNT_BELOW = 0.9  # [-] of the deviation without IMUs, below which they are used


@dataclass(frozen=True)
class _LimbDirections:
    """One limb's direction in a camera and the vertical in the IMU on it, at n instants."""

    segment: str
    bone: FloatArray  # (n, 3) unit vectors in the reference's frame
    vertical: FloatArray  # (n, 3) unit vectors in the IMU's frame


@dataclass
class _State:
    """The unknowns of the estimation."""

    up: FloatArray  # (3,) unit vector
    slopes: FloatArray  # (segments, 3) [-]
    axes: FloatArray  # (limbs, 3) unit vectors in the IMU
    biases: FloatArray  # (limbs,) [-]

    def move(self, step: FloatArray) -> None:
        """Add a step: 2 values of the vertical, 3 per segment, 3 per limb."""
        middle = 2 + self.slopes.size
        self.up = unit_vectors(self.up + _tangents(self.up) @ step[:2])
        self.slopes = self.slopes + step[2:middle].reshape(-1, 3)
        own = step[middle:].reshape(-1, 3)
        turned = [a + _tangents(a) @ one[:2] for a, one in zip(self.axes, own, strict=True)]
        self.axes = unit_vectors(np.array(turned))
        self.biases = self.biases + own[:, 2]


def gravity_from_imus(
    views: Views, verticals: Mapping[str, Track], delay_s: float, up_stddev: float, source: str
) -> Gravity | None:
    """Estimate the vertical in the reference's frame.

    Args:
        views: Joints measured by each camera, with the vertical estimated without the IMUs.
        verticals: The vertical in each IMU, by segment.
        delay_s: Delay of the IMUs' stamps for the same pose [s].
        up_stddev: Standard deviation [rad] of the vertical estimated without the IMUs.
        source: What that was estimated from.

    Returns:
        The vertical in the reference's frame; None if the limbs' motion does not improve it.
    """
    limbs = [
        limb
        for track in views.tracks
        for segment, each in verticals.items()
        if (limb := _matched(track, segment, each, delay_s)) is not None
    ]
    segments = sorted({limb.segment for limb in limbs})
    if len(segments) < MIN_SEGMENTS:
        return None
    known = unit_vectors(views.up)
    alone = _contradicting(limbs, known, up_stddev)
    if alone is not None:
        return Gravity(up=alone[0], stddev=alone[1], source=f"{BODY_IMUS}, not {source}")
    prior = known, up_stddev
    up, own_stddev = _solve(limbs, prior)
    variance = _scatter(limbs, prior, up) ** 2
    share = up_stddev**2 / (up_stddev**2 + variance)
    stddev = float(np.sqrt(own_stddev**2 + share * variance))
    if stddev > IMUS_COUNT_BELOW * up_stddev:
        return None
    up = unit_vectors(known + share * (up - known))
    return Gravity(up=up, stddev=stddev, source=f"{source}, {BODY_IMUS}")


def searched_gravity(
    views: Views, verticals: Mapping[str, Track], delay_s: float, source: str
) -> Gravity:
    """Estimate the vertical where the one without the IMUs is wrong.

    Args:
        views: Joints measured by each camera, with the vertical as found by a search.
        verticals: The vertical in each IMU, by segment.
        delay_s: Delay of the IMUs' stamps for the same pose [s].
        source: What the wrong one was estimated from.
    """
    found = Gravity(up=views.up, stddev=float(SEARCHED_STDDEV), source="")
    for _ in range(SEARCH_ITERATIONS):
        along = replace(views, up=found.up)
        better = gravity_from_imus(along, verticals, delay_s, float(SEARCHED_STDDEV), "")
        found = better or found
    return replace(found, source=f"{BODY_IMUS}, not {source}")


def _contradicting(
    limbs: Sequence[_LimbDirections], known: FloatArray, up_stddev: float
) -> tuple[FloatArray, float] | None:
    """The vertical by the limbs alone, with its standard deviation; None if the known one holds."""
    prior = known, REJECTED_STDDEV
    up, stddev = _solve(limbs, prior)
    off = np.linalg.norm(up - known)
    if off <= REJECTED_FROM * np.hypot(stddev, up_stddev):
        return None
    stddev = float(np.hypot(stddev, _scatter(limbs, prior, up)))
    return None if off <= REJECTED_FROM * np.hypot(stddev, up_stddev) else (up, stddev)


def _scatter(
    limbs: Sequence[_LimbDirections], prior: tuple[FloatArray, float], up: FloatArray
) -> float:
    """Standard deviation [rad] of the vertical ``up`` by how the limbs agree: the jackknife's."""
    segments = {limb.segment for limb in limbs}
    without = [[limb for limb in limbs if limb.segment != segment] for segment in sorted(segments)]
    off = np.array([_solve(others, prior)[0] - up for others in without])
    variance = (1.0 - 1.0 / len(segments)) * float(np.linalg.eigvalsh(off.T @ off)[-1])
    return float(np.sqrt(variance))


def _solve(
    limbs: Sequence[_LimbDirections], prior: tuple[FloatArray, float]
) -> tuple[FloatArray, float]:
    """The vertical and its standard deviation [rad] by these limbs, if their model holds."""
    known, _ = prior
    segments = sorted({limb.segment for limb in limbs})
    state = _State(
        up=known,
        slopes=np.zeros((len(segments), 3)),
        axes=np.array([_axis(limb, known) for limb in limbs]),
        biases=np.zeros(len(limbs)),
    )
    of_segment = [segments.index(limb.segment) for limb in limbs]
    for _ in range(ITERATIONS):
        information, gradient = _normal_equations(limbs, of_segment, state, prior)
        state.move(np.asarray(-np.linalg.solve(information, gradient), float))
    covariance = np.linalg.inv(information)[:2, :2]
    return state.up, float(np.hypot(np.sqrt(np.linalg.eigvalsh(covariance)[-1]), FLOOR_STDDEV))


def _matched(track: Track, segment: str, vertical: Track, delay_s: float) -> _LimbDirections | None:
    if len(track.stamps) < 2:
        return None
    stamps = np.arange(track.stamps[0], track.stamps[-1], 1.0 / RATE)
    start, end = limb_ends(track, segment, stamps)
    bone = end - start
    up = vertical.at(stamps + delay_s)
    known = are_known(bone + up)
    if known.sum() < MIN_SAMPLES:
        return None
    return _LimbDirections(segment, unit_vectors(bone[known]), up[known])


def _axis(limb: _LimbDirections, up: FloatArray) -> FloatArray:
    """Direction of the limb in its IMU, shape (3,), for unbiased measurements and this vertical."""
    axis, *_ = np.linalg.lstsq(limb.vertical, limb.bone @ up, rcond=None)
    return unit_vectors(axis.astype(float))


def _normal_equations(
    limbs: Sequence[_LimbDirections],
    of_segment: Sequence[int],
    state: _State,
    prior: tuple[FloatArray, float],
) -> tuple[FloatArray, FloatArray]:
    """The information and the gradient of the cost, in the order of :meth:`_State.move`."""
    first_own = 2 + state.slopes.size
    size = first_own + 3 * len(limbs)
    information, gradient = 1e-6 * np.eye(size), np.zeros(size)
    across = _tangents(state.up)
    known, stddev = prior
    information[:2, :2] += np.eye(2) / stddev**2
    gradient[:2] += across.T @ (state.up - known) / stddev**2
    weights = np.zeros(size)
    weights[2:first_own] = LIMB_SLOPE_STDDEV**-2
    weights[first_own + 2 :: 3] = LIMB_STDDEV**-2
    information += np.diag(weights)
    gradient[2:first_own] += weights[2:first_own] * state.slopes.reshape(-1)
    gradient[first_own + 2 :: 3] += LIMB_STDDEV**-2 * state.biases
    for index, (limb, segment) in enumerate(zip(limbs, of_segment, strict=True)):
        axis = state.axes[index]
        predicted = limb.bone @ (state.up + state.slopes[segment]) + state.biases[index]
        off = predicted - limb.vertical @ axis
        scale = max(float(robust_stddev(off)), 0.01)
        weight = np.clip(1.0 - (off / (TUKEY * scale)) ** 2, 0.0, None) ** 2
        weight /= (OPTIMISM * scale) ** 2 * CORRELATION_S * RATE
        own = -limb.vertical @ _tangents(axis)
        J = np.column_stack([limb.bone @ across, limb.bone, own, np.ones(len(off))])
        columns = [
            *(0, 1),
            *range(2 + 3 * segment, 5 + 3 * segment),
            *range(first_own + 3 * index, first_own + 3 * index + 3),
        ]
        information[np.ix_(columns, columns)] += J.T @ (J * weight[:, None])
        gradient[columns] += J.T @ (weight * off)
    return information, gradient


def _tangents(v: FloatArray) -> FloatArray:
    """Two unit vectors orthogonal to a unit vector and each other, (3, 2)."""
    other = np.eye(3)[int(np.argmin(np.abs(v)))]
    first = unit_vectors(np.cross(v, other))
    return np.column_stack([first, np.cross(v, first)])
