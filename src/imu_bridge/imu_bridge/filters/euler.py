r"""Roll, pitch and yaw of a quaternion: zhang2015 (3).

:math:`R = R_z(\text{yaw})\,R_y(\text{pitch})\,R_x(\text{roll})`, all [rad].

References:
    Zhang, Xu, Sun (2015), J. System Simulation 27(10), equation (3).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

POLE_COSINE = 1e-7  # [-] cos(pitch) below which roll and yaw cannot be told apart


def roll_pitch_yaw(q: ArrayLike, roll_at_pole: ArrayLike = 0.0) -> NDArray[np.float64]:
    """Roll, pitch and yaw of unit quaternions.

    At pitch = ±90° only yaw ∓ roll is defined. There the roll is taken from ``roll_at_pole``, and
    the yaw follows from it, so that the three angles always give back the same rotation. To stay
    continuous through a pole, hand in the roll of the instant before.

    Args:
        q: Quaternions (x, y, z, w), shape (..., 4).
        roll_at_pole: Roll [rad] to report at a pole, a number or shape (...).

    Returns:
        Roll in (-pi, pi], pitch in [-pi/2, pi/2], yaw in (-pi, pi], [rad], shape (..., 3).
    """
    x, y, z, w = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    sine_roll = 2.0 * (w * x + y * z)  # times cos(pitch), as is the next
    cosine_roll = 1.0 - 2.0 * (x * x + y * y)
    cosine_pitch = np.hypot(sine_roll, cosine_roll)
    # zhang2015 (3); atan2 for the arcsine, which loses half its digits near a pole.
    pitch = np.arctan2(2.0 * (w * y - z * x), cosine_pitch)
    roll = np.arctan2(sine_roll, cosine_roll)
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    at_pole = cosine_pitch < POLE_COSINE
    if np.any(at_pole):
        sign = np.where(pitch > 0.0, 1.0, -1.0)
        pole_roll = np.broadcast_to(np.asarray(roll_at_pole, dtype=float), roll.shape)
        # At the upper pole tan((roll - yaw) / 2) = x / w, at the lower tan((roll + yaw) / 2).
        pole_yaw = _wrapped(sign * (pole_roll - 2.0 * np.arctan2(x, w)))
        roll = np.where(at_pole, _wrapped(pole_roll), roll)
        yaw = np.where(at_pole, pole_yaw, yaw)
        pitch = np.where(at_pole, sign * np.pi / 2.0, pitch)
    return np.stack([roll, pitch, yaw], axis=-1)


def _wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angle [rad] in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2.0 * np.pi)
