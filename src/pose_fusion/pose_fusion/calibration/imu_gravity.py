r"""The vertical in the reference sensor's frame, from IMUs on the limbs that it sees.

With :math:`u` the vertical and :math:`b` a bone's direction in the camera's frame, and :math:`g`
the vertical and :math:`a` the same bone in the IMU's, :math:`u \cdot b(t) + c = a \cdot g(t)` for
all instants, where :math:`c` is what the tracker sees wrong of that limb all the time. The unit
vectors :math:`u`, one for all, and :math:`a`, one a limb, and :math:`c` are found by Gauss-Newton
with Tukey's weights, from what the person's upright stance says of :math:`u`. Neither headings nor
the mountings of the IMUs need be known; but limbs must have pointed elsewhere than down.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from pose_common.joints import JOINT_INDEX
from pose_fusion.calibration.gravity import Gravity
from pose_fusion.calibration.imu_motion import BONES, Felt, View
from pose_fusion.calibration.joint_delays import CORRELATION_S
from pose_fusion.calibration.rigid_transform import TUKEY
from pose_fusion.streams.samples import FloatArray

BODY_IMUS = "upright body and body-worn IMUs"
RATE = 10.0  # [Hz] of the instants that are compared
LEAST_SAMPLES = 50  # [-] of a limb
ITERATIONS = 15
SCATTER = 1.4826  # [-] standard deviation of a Gaussian over its median absolute deviation
# [rad] of the IMUs' own tilt and of what limbs are seen wrong alike, which no more motion betters.
# So large that what is told fits the errors of eight synthetic motions.
FLOOR_STDDEV = np.radians(1.2)
LIMB_STDDEV = 0.05  # [-] of what is seen wrong of a limb all the time: 1.5 cm of 30 cm
OPTIMISM = 2.0  # [-] true over formal errors: a limb's slow errors are few, not many
IMUS_COUNT_BELOW = 0.85  # [-] of the deviation without them, with which they earn a mention


def gravity_from_imus(
    views: Sequence[View],
    turns: Sequence[FloatArray],
    felt: Mapping[str, Felt],
    delay_s: float,
    up_stddev: float,
) -> Gravity | None:
    """Find the vertical.

    Args:
        views: What the cameras see, with the vertical as it is known without the IMUs.
        turns: ``R_reference_sensor`` of each, (3, 3).
        felt: What the IMUs feel, by segment.
        delay_s: How much later the IMUs' stamps are for the same pose [s].
        up_stddev: Deviation [rad] of the vertical as it is known without the IMUs.

    Returns:
        The vertical in the reference's frame; None if the limbs' motion adds nothing to it.
    """
    limbs = [
        pair
        for view, R in zip(views, turns, strict=True)
        for segment, each in felt.items()
        if (pair := _matched(view, R, segment, each, delay_s)) is not None
    ]
    if not limbs:
        return None
    up = np.mean([R @ view.up for view, R in zip(views, turns, strict=True)], axis=0)
    up /= np.linalg.norm(up)
    known, biases = up, np.zeros(len(limbs))
    axes = [_unit(np.linalg.lstsq(g, b @ up, rcond=None)[0]) for b, g in limbs]
    for _ in range(ITERATIONS):
        step, information = _step(limbs, up, axes, biases, (known, up_stddev))
        up = _unit(up + _tangents(up) @ step[:2])
        axes = [_unit(a + _tangents(a) @ step[3 * i + 2 : 3 * i + 4]) for i, a in enumerate(axes)]
        biases = biases + step[4::3]
    covariance = np.linalg.inv(information)[:2, :2]
    random_stddev = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    if random_stddev > IMUS_COUNT_BELOW * up_stddev:
        return None
    return Gravity(up=up, stddev=float(np.hypot(random_stddev, FLOOR_STDDEV)), source=BODY_IMUS)


def _matched(
    view: View, R: FloatArray, segment: str, felt: Felt, delay_s: float
) -> tuple[FloatArray, FloatArray] | None:
    """A limb's directions in the reference's frame and the verticals felt with them, (n, 3)."""
    start, end = (JOINT_INDEX[name] for name in BONES[segment])
    track = view.track
    if len(track.stamps) < 2:
        return None
    stamps = np.arange(track.stamps[0], track.stamps[-1], 1.0 / RATE)
    joints = track.at(stamps)
    bone = joints[:, end] - joints[:, start]
    up = felt.at(stamps + delay_s)
    known = np.isfinite(bone + up).all(axis=1)
    if known.sum() < LEAST_SAMPLES:
        return None
    bone = bone[known] @ R.T
    return bone / np.linalg.norm(bone, axis=1, keepdims=True), up[known]


def _step(
    limbs: Sequence[tuple[FloatArray, FloatArray]],
    up: FloatArray,
    axes: Sequence[FloatArray],
    biases: FloatArray,
    prior: tuple[FloatArray, float],
) -> tuple[FloatArray, FloatArray]:
    """A Gauss-Newton step in ``up``, then in each limb's axis and bias, and the information."""
    size = 2 + 3 * len(limbs)
    information, gradient = 1e-6 * np.eye(size), np.zeros(size)
    across = _tangents(up)
    known, stddev = prior
    information[:2, :2] += np.eye(2) / stddev**2
    gradient[:2] += across.T @ (up - known) / stddev**2
    for index, ((bone, felt), axis) in enumerate(zip(limbs, axes, strict=True)):
        off = bone @ up + biases[index] - felt @ axis
        scale = max(SCATTER * float(np.median(np.abs(off))), 0.01)
        weight = np.clip(1.0 - (off / (TUKEY * scale)) ** 2, 0.0, None) ** 2
        weight /= (OPTIMISM * scale) ** 2 * CORRELATION_S * RATE
        J = np.column_stack([bone @ across, -felt @ _tangents(axis), np.ones(len(off))])
        columns = [0, 1, *range(3 * index + 2, 3 * index + 5)]
        information[np.ix_(columns, columns)] += J.T @ (J * weight[:, None])
        gradient[columns] += J.T @ (weight * off)
        information[columns[-1], columns[-1]] += LIMB_STDDEV**-2
        gradient[columns[-1]] += biases[index] / LIMB_STDDEV**2
    return np.asarray(-np.linalg.solve(information, gradient), float), information


def _tangents(v: FloatArray) -> FloatArray:
    """Two unit vectors across a unit vector, (3, 2)."""
    other = np.eye(3)[int(np.argmin(np.abs(v)))]
    first = _unit(np.cross(v, other))
    return np.column_stack([first, np.cross(v, first)])


def _unit(v: FloatArray) -> FloatArray:
    return np.asarray(v / np.linalg.norm(v))
