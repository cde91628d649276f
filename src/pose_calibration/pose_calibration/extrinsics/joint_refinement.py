r"""Joint estimation of all sensors' poses and all joints' view offsets, by least squares.

A tracker measures the surface in front of a joint, and has a systematic offset of each joint in the
body, different in every view. With :math:`z` the position of a joint measured by sensor :math:`s`,
:math:`\hat z` its direction from the sensor, :math:`d_j` the depth of soft tissue and
:math:`b_{s,j}` the offset in axes fixed to the body, its position in the reference frame is

.. math:: x_{s,j} = T_s (z_{s,j} + d_j \hat z_{s,j}) - R_{body} b_{s,j}

The cost is the scatter of :math:`x_{s,j}` about the sensors' weighted mean, which replaces the
unknown true joint, with priors on :math:`d` and :math:`b`. If the person never turns, :math:`b` and
:math:`T` cannot be separated: the covariance shows it.

Each sample is weighted by its expected error: trackers lag and are imprecise where a joint moves,
and infer joints where the body faces away from the sensor. On a synthetic subject (six motions,
four seeds each, 30 s) these weights halved the error of the rotation.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_calibration.geometry.rigid_transform import MAXWELL_MEDIAN, TUKEY
from pose_core.api import FloatArray, skew, transformed
from pose_core.finite_numbers import are_known
from pose_core.joints import JOINT_INDEX, JOINTS

OFFSET_STDDEV_M = 0.012  # [m] prior of an offset in the body, per axis and sensor
DEPTH_M = 0.015  # [m] prior mean of the soft tissue in front of a joint
DEPTH_STDDEV_M = 0.01  # [m]
STILL_ERROR_M = 0.007  # [m] of a joint at rest, body facing the sensor
SPEED_ERROR_S = 0.1  # [m] per [m/s] of a joint's speed
TURNED_ERROR_M = 0.1  # [m] added if the body stands sideways to the sensor
MAX_TURNED = 1.5  # [-] 1 sideways, 2 from behind
MIN_WEIGHT = 0.01  # [-] of an outlier in the mean of the other sensors
MIN_TOTAL = 1e-9  # [1/m²] replaces 0 where no sensor measured a joint
MIN_SCALE = 0.5  # [-] lower bound of the ratio of measured to expected errors
OPTIMISM = 2.4  # [-] true over formal errors, on synthetic subjects: errors are correlated
SYSTEMATIC_ROTATION = np.radians(0.25)  # [rad] by trackers' errors that more frames do not reduce
VOXEL_M = 0.1  # [m] samples of a joint in one voxel at equal heading have correlated errors
HEADING_BIN = np.radians(20.0)  # [rad]
VOXEL_OBSERVATIONS = 16.0  # [-] largest number of independent samples in a voxel
MAX_ITERATIONS = 30
CONVERGED = 1e-6  # [m, rad] largest step of a pose that ends the iteration
COLUMNS = 10  # [-] per sensor and joint: pose 6, offset 3, depth 1


@dataclass(frozen=True, kw_only=True)
class Refinement:
    """Poses of the sensors and systematic errors of their trackers."""

    T_reference_sensor: FloatArray  # (sensors, 4, 4), the first an identity
    offsets: FloatArray  # (sensors, 15, 3) [m] in the body's axes: x forward, y left, z up
    rotation_stddev: FloatArray  # (sensors,) [rad] about the least certain axis
    position_stddev: FloatArray  # (sensors,) [m] along the least certain axis
    weights: FloatArray  # (frames, sensors, 15) [-] robust; 0 for outliers and unknown joints


def body_axes(positions: FloatArray) -> FloatArray:
    """``R_reference_body``: the body's heading about its mean vertical axis, shape (n, 3, 3).

    Args:
        positions: Mean joints [m] over the sensors, shape (n, 15, 3), NaN where unknown. Frames
            without a heading get that of the nearest earlier frame.
    """
    at = {name: positions[:, index] for name, index in JOINT_INDEX.items()}
    trunk = at["neck"] - 0.5 * (at["left_hip"] + at["right_hip"])
    lateral = np.nan_to_num(at["left_hip"] - at["right_hip"])
    lateral = lateral + np.nan_to_num(at["left_shoulder"] - at["right_shoulder"])
    known = are_known(trunk) & (np.linalg.norm(lateral, axis=1) > 0.05)
    if not known.any():
        return np.tile(np.eye(3), (len(positions), 1, 1))
    up = np.median(trunk[known], axis=0)
    up /= np.linalg.norm(up)
    last = np.maximum.accumulate(np.where(known, np.arange(len(positions)), -1))
    last[last < 0] = int(np.argmax(known))
    lateral = lateral[last]
    y = lateral - (lateral @ up)[:, None] * up
    y /= np.maximum(np.linalg.norm(y, axis=1, keepdims=True), 1e-9)
    return np.stack([np.cross(y, up), y, np.broadcast_to(up, y.shape)], axis=2)


class JointRefinement:
    """Gauss-Newton estimation of all sensors' poses, offsets and depths.

    Args:
        positions: Joints [m], each in its sensor's frame, shape (frames, sensors, 15, 3), NaN where
            not tracked.
        speeds: Speed of each joint [m/s], shape (frames, 15).
        T_reference_sensor: Initial poses of the sensors, shape (sensors, 4, 4).
    """

    def __init__(
        self, positions: FloatArray, speeds: FloatArray, T_reference_sensor: FloatArray
    ) -> None:
        is_known = are_known(positions)
        is_known &= (is_known.sum(axis=1) >= 2)[:, None]  # at least two views are needed to compare
        is_in_any = np.asarray(is_known.any(axis=1))
        self._is_known = is_known
        self._z = np.where(is_known[..., None], positions, 0.0)
        length = np.linalg.norm(self._z, axis=3, keepdims=True)
        self._sight = self._z / np.maximum(length, 1e-9)
        self._T = T_reference_sensor.copy()
        count = positions.shape[1]
        self._offsets = np.zeros((count, len(JOINTS), 3))
        self._depths = np.full(len(JOINTS), DEPTH_M)
        self._size = 6 * (count - 1)
        self._axes = np.zeros((len(is_known), 3, 3))
        mean = self._mean(is_known.astype(float))
        self._axes = body_axes(np.where(is_in_any[..., None], mean, np.nan))
        self._variance = self._expected_variance(speeds)
        self._share = observation_share(mean, self._axes, is_in_any)
        self._centre = mean[is_in_any].mean(axis=0)
        self._robust = is_known.astype(float)
        self._scale = 1.0
        # Jacobian of a joint's positions by the state: constant entries are filled in once.
        self._J = np.zeros((len(JOINTS), count, len(is_known), 3, COLUMNS))
        self._J[..., 3:6] = np.eye(3)
        self._J[..., 6:9] = -self._axes

    def solve(self) -> Refinement:
        """Iterate to the minimum of the cost."""
        self._reweight()
        for _ in range(MAX_ITERATIONS):
            H, gradient = self._normal_equations()
            step = np.asarray(np.linalg.solve(H, -gradient), float)
            self._apply(step)
            self._reweight()
            if np.abs(step[: self._size]).max(initial=0.0) < CONVERGED:
                break
        covariance = np.asarray(np.linalg.inv(self._normal_equations()[0]), float)
        stddev = np.array([self._stddev(covariance, s) for s in range(len(self._T))])
        return Refinement(
            T_reference_sensor=self._T,
            offsets=self._offsets,
            rotation_stddev=stddev[:, 0],
            position_stddev=stddev[:, 1],
            weights=self._robust,
        )

    def _stddev(self, covariance: FloatArray, s: int) -> tuple[float, float]:
        """Standard deviations of a sensor's rotation [rad] and of its position [m]."""
        if s == 0:
            return 0.0, 0.0
        block = covariance[6 * (s - 1) : 6 * s, 6 * (s - 1) : 6 * s]
        to_sensor = np.hstack([-skew(self._T[s, :3, 3] - self._centre), np.eye(3)])
        place = to_sensor @ block @ to_sensor.T
        rotation_stddev = np.sqrt(np.linalg.eigvalsh(block[:3, :3])[-1])
        return (
            float(np.hypot(OPTIMISM * rotation_stddev, SYSTEMATIC_ROTATION)),
            OPTIMISM * float(np.sqrt(np.linalg.eigvalsh(place)[-1])),
        )

    def _places(self) -> FloatArray:
        """Joint positions of every sensor in the reference frame, (frames, sensors, 15, 3)."""
        corrected = self._z + self._depths[:, None] * self._sight
        moved = np.stack([transformed(T, corrected[:, s]) for s, T in enumerate(self._T)], axis=1)
        bias = self._offsets.reshape(-1, 3) @ self._axes.transpose(0, 2, 1)
        return moved - bias.reshape(moved.shape)

    def _mean(self, weights: FloatArray) -> FloatArray:
        """Weighted mean over the sensors, (frames, 15, 3)."""
        total = np.maximum(weights.sum(axis=1), 1e-12)
        return (weights[..., None] * self._places()).sum(axis=1) / total[..., None]

    def _expected_variance(self, speeds: FloatArray) -> FloatArray:
        """Expected variance [m²] of each sample, (frames, sensors, 15)."""
        forward = np.einsum("sji,tj->tsi", self._T[:, :3, :3], self._axes[:, :, 0])
        count = np.maximum(self._is_known.sum(axis=2), 1)[..., None]
        sight = np.where(self._is_known[..., None], self._sight, 0.0).sum(axis=2) / count
        turned = np.clip(1.0 + (forward * sight).sum(axis=2), 0.0, MAX_TURNED)
        moving = (SPEED_ERROR_S * speeds)[:, None] ** 2
        return STILL_ERROR_M**2 + moving + ((TURNED_ERROR_M * turned**2) ** 2)[..., None]

    def _reweight(self) -> None:
        """Update Tukey's weights from each view's distance to the others' mean, and the scale."""
        places = self._places()
        w = np.maximum(self._robust, MIN_WEIGHT) / self._variance * self._is_known
        of_others = np.maximum(w.sum(axis=1, keepdims=True) - w, 1e-12)
        moment = (w[..., None] * places).sum(axis=1, keepdims=True) - w[..., None] * places
        distance = np.linalg.norm(places - moment / of_others[..., None], axis=3)
        squares = w**2 * self._variance
        squares = squares.sum(axis=1, keepdims=True) - squares
        expected = np.sqrt(self._variance + squares / of_others**2)
        ratio = distance / expected
        self._scale = max(MIN_SCALE, float(np.median(ratio[self._is_known])) / MAXWELL_MEDIAN)
        share = np.minimum(ratio / (TUKEY * self._scale), 1.0)
        self._robust = np.where(self._is_known, (1.0 - share**2) ** 2, 0.0)

    def _normal_equations(self) -> tuple[FloatArray, FloatArray]:
        count = self._z.shape[1]
        size = self._size + 3 * count * len(JOINTS) + len(JOINTS)
        H, gradient = np.zeros((size, size)), np.zeros(size)
        places = self._places()
        weights = self._robust * self._share[:, None] / (self._variance * self._scale**2)
        for joint in range(len(JOINTS)):
            columns = self._columns(joint)
            M, g = self._joint_block(joint, places[:, :, joint], weights[:, :, joint])
            kept = columns >= 0
            np.add.at(H, np.ix_(columns[kept], columns[kept]), M[np.ix_(kept, kept)])
            np.add.at(gradient, columns[kept], g[kept])
        offsets, depths = slice(self._size, size - len(JOINTS)), slice(size - len(JOINTS), size)
        diagonal = np.zeros(size)
        diagonal[offsets], diagonal[depths] = OFFSET_STDDEV_M**-2, DEPTH_STDDEV_M**-2
        gradient[offsets] += self._offsets.reshape(-1) / OFFSET_STDDEV_M**2
        gradient[depths] += (self._depths - DEPTH_M) / DEPTH_STDDEV_M**2
        return H + np.diag(diagonal), gradient

    def _joint_block(
        self, joint: int, places: FloatArray, w: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Normal matrix and gradient of one joint, over (sensor, column).

        The scatter about the weighted mean is a quadratic form with the matrix diag(w) − w wᵀ/Σw.
        """
        frames, count = w.shape
        J = self._J[joint]
        J[..., 0:3] = -skew(places - self._centre).swapaxes(0, 1)
        J[..., 9] = self._sight[:, :, joint].swapaxes(0, 1) @ self._T[:, :3, :3].swapaxes(1, 2)
        total = np.maximum(w.sum(axis=1), MIN_TOTAL)
        mean = (w[..., None] * places).sum(axis=1) / total[:, None]
        weighted = J * w.T[:, :, None, None]
        mixed = (weighted / np.sqrt(total)[:, None, None]).reshape(count, -1, COLUMNS)
        mixed = mixed.swapaxes(0, 1).reshape(3 * frames, -1)
        weighted = weighted.reshape(count, -1, COLUMNS).swapaxes(1, 2)
        M = np.zeros((count, COLUMNS, count, COLUMNS))
        own = np.arange(count)
        M[own, :, own] = weighted @ J.reshape(count, -1, COLUMNS)
        g = weighted @ (places - mean[:, None]).swapaxes(0, 1).reshape(count, -1, 1)
        return M.reshape(count * COLUMNS, -1) - mixed.T @ mixed, g.reshape(-1)

    def _columns(self, joint: int) -> NDArray[np.intp]:
        """Index in the whole state of each (sensor, column) of a joint; -1 if it is fixed."""
        count = self._z.shape[1]
        s = np.arange(count)[:, None]
        poses = np.where(s > 0, 6 * (s - 1) + np.arange(6), -1)
        offsets = self._size + 3 * (s * len(JOINTS) + joint) + np.arange(3)
        depths = np.full_like(s, self._size + 3 * count * len(JOINTS) + joint)
        return np.hstack([poses, offsets, depths]).reshape(-1)

    def _apply(self, step: FloatArray) -> None:
        for s in range(1, len(self._T)):
            turn, shift = step[6 * (s - 1) : 6 * s - 3], step[6 * s - 3 : 6 * s]
            R = Rotation.from_rotvec(turn).as_matrix()
            T = self._T[s]
            T[:3, 3] = R @ (T[:3, 3] - self._centre) + self._centre + shift
            T[:3, :3] = R @ T[:3, :3]
        count = self._offsets.size
        self._offsets += step[self._size : self._size + count].reshape(self._offsets.shape)
        self._depths += step[self._size + count :]


def observation_share(
    positions: FloatArray, axes: FloatArray, is_known: NDArray[np.bool_]
) -> FloatArray:
    """Weight of each sample [-], shape (frames, 15): samples in a voxel are correlated.

    Args:
        positions: Joints [m], (frames, 15, 3).
        axes: The body's axes, (frames, 3, 3).
        is_known: Which joints are known, (frames, 15).
    """
    bins = np.floor(np.arctan2(axes[:, 2, 0], axes[:, 0, 0]) / HEADING_BIN)
    share = np.zeros(is_known.shape)
    for joint in range(len(JOINTS)):
        used = is_known[:, joint]
        voxels = np.column_stack([bins, np.floor(positions[:, joint] / VOXEL_M)])[used]
        _, members, counts = np.unique(voxels, axis=0, return_inverse=True, return_counts=True)
        share[used, joint] = np.minimum(1.0, VOXEL_OBSERVATIONS / counts)[members.reshape(-1)]
    return share
