"""Finds where the sensors stand, from the skeletons that they see at the same time (li2020 (1)).

The paper finds ``R`` and ``T`` between its two depth cameras with a board that both see; here the
person's joints take the board's place. Every sensor is calibrated against the first, the reference.

All joints and frames weigh alike. Heavier weights for the trunk, by each joint's scatter, or for
places that the body visited rarely were tried on two-view recordings at 0, 45 and 90 degrees and
agreed no better on the half that had not been used; the robust fit alone did, most at 90 degrees.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_common.errors import ParameterError
from pose_common.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_fusion.calibration.extrinsics import Extrinsics, PairResiduals
from pose_fusion.calibration.floor import KnownMounting, estimate_floor
from pose_fusion.calibration.rigid_transform import (
    CalibrationError,
    estimate_rigid_transform_robustly,
    transformed,
)
from pose_fusion.streams.samples import FloatArray
from pose_fusion.streams.time_alignment import AlignedFrame

NS_PER_S = 1_000_000_000
JOINT_ERROR_M = 0.02  # [m] view-dependent error of one joint, which no repetition averages out
VIEW_BIAS = np.radians(0.5)  # [rad] by which fits to two halves of a recording differ
VOXEL_M = 0.1  # [m] one joint within one voxel counts as one independent observation
CELL_M = 0.3  # [m] places of the body are told apart by this
PAUSE_NS = NS_PER_S  # [ns] a longer step between frames is a pause
KEPT_EVERY_NS = 50_000_000  # [ns] frames closer in time say the same
MAX_KEPT_FRAMES = 900  # [-] 45 s of frames
TRUNK = [
    JOINT_INDEX[name]
    for name in ("neck", "torso", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
]


@dataclass(frozen=True, kw_only=True)
class CalibrationLimits:
    """What a calibration has to reach to be believed."""

    minimum_frames: int = 60  # [-] frames in which a sensor and the reference see the person
    rotation_stddev: float = np.radians(1.0)  # [rad] about the least certain axis
    median_residual: float = 0.15  # [m]
    inlier_share: float = 0.5  # [-]


@dataclass(frozen=True)
class _Kept:
    """One frame in the calibrator's memory."""

    stamp_ns: int
    positions: FloatArray  # (sensors, 15, 3) [m], each in its sensor's frame; NaN if not TRACKED


class ExtrinsicsCalibrator:
    """Collects what several sensors see of one person and finds where they stand.

    Memory is bounded: where it is full, every other frame goes from the place of the body that has
    the most, so that a person who stands for an hour and walks for a minute leaves both.

    Args:
        sensors: Their names, the reference first. With a single one, only the floor is found.
        limits: What the calibration has to reach.
        mounting: What is known of the reference's mounting.
    """

    def __init__(
        self,
        sensors: Sequence[str],
        limits: CalibrationLimits | None = None,
        mounting: KnownMounting | None = None,
    ) -> None:
        if not sensors or len(set(sensors)) != len(sensors):
            raise ParameterError(f"sensors = {list(sensors)}: expected one or more different names")
        self.sensors = tuple(sensors)
        self.limits = limits or CalibrationLimits()
        self._mounting = mounting or KnownMounting()
        self._cells: dict[tuple[int, ...], list[_Kept]] = {}
        self._kept_count = 0
        self._last_kept_ns: int | None = None
        self.frames_in = 0
        self.frames_with = dict.fromkeys(self.sensors[1:], 0)
        self.observed_s = 0.0  # [s] for which the reference and another sensor saw the person
        self._last_ns: int | None = None

    def add(self, frame: AlignedFrame) -> None:
        """Take what the sensors saw at one instant."""
        self.frames_in += 1
        positions = self._tracked_positions(frame)
        seen = np.asarray(np.isfinite(positions).all(axis=2))  # (sensors, joints)
        shared = np.asarray((seen & seen[0]).any(axis=1))
        if not shared[0] or (len(self.sensors) > 1 and not shared[1:].any()):
            return
        for name, both in zip(self.sensors[1:], shared[1:], strict=True):
            self.frames_with[name] += int(both)
        if self._last_ns is not None and 0 < frame.stamp_ns - self._last_ns < PAUSE_NS:
            self.observed_s += (frame.stamp_ns - self._last_ns) / NS_PER_S
        self._last_ns = frame.stamp_ns
        last_ns = self._last_kept_ns
        if last_ns is not None and 0 <= frame.stamp_ns - last_ns < KEPT_EVERY_NS:
            return
        self._last_kept_ns = frame.stamp_ns
        self._keep(_Kept(frame.stamp_ns, positions), shared)

    def solve(self) -> Extrinsics:
        """Find where the sensors stand.

        Raises:
            CalibrationError: If what was seen does not determine it; the message says why.
        """
        positions = self._kept_positions()
        T_reference_sensor = {self.sensors[0]: np.eye(4)}
        residuals = {}
        for index, name in enumerate(self.sensors[1:], start=1):
            if self.frames_with[name] < self.limits.minimum_frames:
                raise CalibrationError(self._too_few_frames(name))
            T, pair = self._solve_pair(positions[:, 0], positions[:, index], name)
            T_reference_sensor[name], residuals[name] = T, pair
        in_reference = np.stack(
            [
                transformed(T_reference_sensor[name], positions[:, index])
                for index, name in enumerate(self.sensors)
            ]
        )
        floor = estimate_floor(in_reference, self._mounting)
        return Extrinsics(
            reference=self.sensors[0],
            T_reference_sensor=T_reference_sensor,
            T_map_reference=floor.T_map_reference,
            residuals=residuals,
            floor=floor,
            clock_offset_ns=dict.fromkeys(self.sensors, 0),
        )

    def _tracked_positions(self, frame: AlignedFrame) -> FloatArray:
        positions = np.full((len(self.sensors), len(JOINTS), 3), np.nan)
        for index, name in enumerate(self.sensors):
            sample = frame.samples.get(name)
            if sample is not None:
                tracked = sample.tracking_state == TrackingState.TRACKED
                positions[index, tracked] = sample.positions[tracked]
        return positions

    def _keep(self, kept: _Kept, shared: NDArray[np.bool_]) -> None:
        trunk = kept.positions[0, TRUNK]
        trunk = trunk[np.isfinite(trunk).all(axis=1)]
        place = np.floor(trunk.mean(axis=0) / CELL_M).astype(int) if len(trunk) else np.zeros(3)
        key = (*(int(number) for number in place), *(int(one) for one in shared))
        self._cells.setdefault(key, []).append(kept)
        self._kept_count += 1
        if self._kept_count > MAX_KEPT_FRAMES:
            fullest = max(self._cells.values(), key=len)
            before = len(fullest)
            del fullest[1::2]
            self._kept_count -= before - len(fullest)

    def _kept_positions(self) -> FloatArray:
        """All kept frames in the order of time, shape (n, sensors, 15, 3)."""
        frames = sorted(
            (kept for cell in self._cells.values() for kept in cell),
            key=lambda kept: kept.stamp_ns,
        )
        if not frames:
            raise CalibrationError(self._too_few_frames(self.sensors[-1]))
        return np.stack([kept.positions for kept in frames])

    def _too_few_frames(self, name: str) -> str:
        if len(self.sensors) == 1:
            return f"'{name}' never tracked the person: let it see the person and calibrate again"
        return (
            f"found {self.frames_with[name]} frames in which both '{self.sensors[0]}' and '{name}' "
            f"track the person, expected {self.limits.minimum_frames} or more: stay longer where "
            "both see the whole person"
        )

    def _solve_pair(
        self, reference: FloatArray, sensor: FloatArray, name: str
    ) -> tuple[FloatArray, PairResiduals]:
        shared = np.isfinite(reference).all(axis=2) & np.isfinite(sensor).all(axis=2)
        source, target = sensor[shared], reference[shared]
        fit = estimate_rigid_transform_robustly(source, target)
        raw = np.linalg.norm(source - target, axis=1)
        joints = np.broadcast_to(np.arange(len(JOINTS)), shared.shape)[shared]
        inlier = fit.weights > 0.0
        rotation_stddev, extents = observability(target[inlier], joints[inlier], fit.sigma)
        pair = PairResiduals(
            frames=self.frames_with[name],
            raw_median=float(np.median(raw)),
            raw_rms=_rms(raw),
            median=float(np.median(fit.residuals)),
            rms=_rms(fit.residuals),
            inlier_rms=_rms(fit.residuals[inlier]),
            inlier_share={
                JOINTS[joint]: float(inlier[joints == joint].mean()) for joint in np.unique(joints)
            },
            rotation_stddev=rotation_stddev,
            spread=extents,
        )
        self._check(pair, name)
        return fit.T_target_source, pair

    def _check(self, pair: PairResiduals, name: str) -> None:
        limits, reference = self.limits, self.sensors[0]
        if pair.median > limits.median_residual or pair.all_inlier_share < limits.inlier_share:
            raise CalibrationError(
                f"'{reference}' and '{name}' disagree even after calibration: median "
                f"{pair.median:.3f} m, {pair.all_inlier_share:.0%} inliers; expected at most "
                f"{limits.median_residual:.3f} m and at least {limits.inlier_share:.0%}: let both "
                "see the same single person, and check that their clocks agree"
            )
        if pair.rotation_stddev > limits.rotation_stddev:
            raise CalibrationError(
                f"too little motion between '{reference}' and '{name}': it leaves the rotation "
                f"uncertain by {np.degrees(pair.rotation_stddev):.1f} deg, expected at most "
                f"{np.degrees(limits.rotation_stddev):.1f} deg (spread of the joints "
                + ", ".join(f"{extent:.2f}" for extent in pair.spread)
                + " m): raise the arms sideways and walk about"
            )


def observability(
    points: FloatArray, joints: NDArray[np.intp], sigma: float
) -> tuple[float, tuple[float, float, float]]:
    """How well matched joints determine a rotation.

    A sensor sees each joint a little off, alike in every frame in which the body stands the same
    way: a joint counts once in each voxel of space that it visits, not once a frame.

    Args:
        points: Shape (n, 3) [m].
        joints: Index of each point's joint, shape (n,).
        sigma: Scatter [m] of one coordinate.

    Returns:
        Standard deviation [rad] of the rotation about the least certain axis, infinite if the
        points leave it free; and the spread [m] of the points along their principal axes.
    """
    voxels = np.column_stack([joints, np.floor(points / VOXEL_M).astype(int)])
    _, first = np.unique(voxels, axis=0, return_index=True)
    distinct = points[first]
    centred = distinct - distinct.mean(axis=0)
    extents = np.linalg.svd(centred, compute_uv=False)
    squares = np.zeros(3)
    squares[: len(extents)] = extents**2
    lever = squares.sum() - squares.max()  # about the longest axis [m^2]
    motion = max(sigma, JOINT_ERROR_M) / np.sqrt(lever) if lever > 0.0 else np.inf
    rms = np.sqrt(squares / len(distinct))
    return float(np.hypot(motion, VIEW_BIAS)), (float(rms[0]), float(rms[1]), float(rms[2]))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
