"""Where the sensors stand, roughly: pair by pair, then along the pairs that see most together.

A tracker that sees a person from behind takes it for one who faces it, and calls the left right:
such frames are found and their sides exchanged before anything else is made of them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_calibration.rigid_transform import (
    CalibrationError,
    RobustFit,
    estimate_rigid_transform_robustly,
)
from pose_core.api import FloatArray, inverse, transformed
from pose_core.finite_numbers import nan_mean
from pose_core.joints import JOINT_INDEX, JOINTS

OTHER_SIDE = [
    JOINT_INDEX[name.replace("left_", "#").replace("right_", "left_").replace("#", "right_")]
    for name in JOINTS
]
"""Index of each joint's mirror image."""
LATERAL = [index for index, other in enumerate(OTHER_SIDE) if other != index]
MIDDLE = [index for index, other in enumerate(OTHER_SIDE) if other == index]
FLIPPED_BELOW = 0.6  # [-] of the distance as labelled: exchanged sides agree that much better
FLIPPED_ABOVE_M = 0.08  # [m] a smaller distance as labelled needs no exchange
ROUNDS = 3  # [-] of fitting and exchanging


@dataclass(frozen=True, kw_only=True)
class PairFit:
    """How one sensor stands to another."""

    T_target_source: FloatArray  # (4, 4)
    fit: RobustFit


def exchanged(positions: FloatArray, flipped: NDArray[np.bool_]) -> FloatArray:
    """Skeletons (n, 15, 3) with left and right exchanged where ``flipped`` (n,)."""
    return np.where(flipped[:, None, None], positions[:, OTHER_SIDE], positions)


def find_flips(view: FloatArray, other: FloatArray) -> NDArray[np.bool_]:
    """Frames in which another view has left and right the wrong way round, (n,).

    Args:
        view: Joints [m], (n, 15, 3), NaN where unknown.
        other: The same joints by another sensor, in the same frame.
    """
    as_labelled = _mean_distance(view[:, LATERAL], other[:, LATERAL])
    swapped = _mean_distance(view[:, LATERAL], other[:, OTHER_SIDE][:, LATERAL])
    flipped: NDArray[np.bool_] = (swapped < FLIPPED_BELOW * as_labelled) & (
        as_labelled > FLIPPED_ABOVE_M
    )
    return flipped


def fit_pair(target: FloatArray, source: FloatArray) -> tuple[PairFit, NDArray[np.bool_]]:
    """Fit one view to another, exchanging sides where that agrees better.

    Two beginnings are tried, all joints and the midline alone, which knows no sides; the one that
    ends with the smaller median distance counts.

    Args:
        target: Joints [m] in the target's frame, (n, 15, 3), NaN where unknown.
        source: The same in the source's frame.

    Returns:
        The fit and which of the source's frames had their sides exchanged.

    Raises:
        CalibrationError: If the joints do not determine it.
    """
    best: tuple[PairFit, NDArray[np.bool_]] | None = None
    failure: CalibrationError | None = None
    for joints in (list(range(len(JOINTS))), MIDDLE):
        try:
            found = _fit_from(target, source, joints)
        except CalibrationError as error:
            failure = failure or error
            continue
        if best is None or _median(found[0]) < 0.9 * _median(best[0]):
            best = found
        if not best[1].any() and np.mean(best[0].fit.weights > 0.0) > 0.9:
            break  # nothing flipped, hardly an outlier: no other beginning can be better
    if best is None:
        raise failure or CalibrationError("found no matched joints")
    return best


def spanning_transforms(
    positions: FloatArray, shared_frames: NDArray[np.int_], minimum_frames: int
) -> tuple[dict[int, FloatArray], dict[int, int], FloatArray]:
    """Place every sensor that is linked to the first, along the pairs that share most frames.

    Args:
        positions: Joints [m], each in its sensor's frame, (frames, sensors, 15, 3).
        shared_frames: In how many frames two sensors see the person, (sensors, sensors).
        minimum_frames: Pairs that share fewer are no link.

    Returns:
        ``T_first_sensor`` by index of the sensors that could be placed; the sensor that each was
        placed by; and the positions with exchanged sides made good.

    Raises:
        CalibrationError: If a linked pair does not determine its transform.
    """
    positions = positions.copy()
    placed: dict[int, FloatArray] = {0: np.eye(4)}
    partner: dict[int, int] = {}
    while True:
        links = [
            (int(shared_frames[a, b]), -b, a, b)
            for a in placed
            for b in range(len(shared_frames))
            if b not in placed and shared_frames[a, b] >= minimum_frames
        ]
        if not links:
            return placed, partner, positions
        _, _, a, b = max(links)
        found, flipped = fit_pair(positions[:, a], positions[:, b])
        positions[:, b] = exchanged(positions[:, b], flipped)
        placed[b] = placed[a] @ found.T_target_source
        partner[b] = a


def relative(placed: dict[int, FloatArray], target: int, source: int) -> FloatArray:
    """``T_target_source`` of two placed sensors."""
    return inverse(placed[target]) @ placed[source]


def _fit_from(
    target: FloatArray, source: FloatArray, joints: list[int]
) -> tuple[PairFit, NDArray[np.bool_]]:
    flipped = np.zeros(len(source), bool)
    fit = _robust_fit(target[:, joints], source[:, joints])
    for _ in range(ROUNDS):
        now = find_flips(target, transformed(fit.T_target_source, source))
        if len(joints) == len(JOINTS) and (now == flipped).all():
            break
        flipped, joints = now, list(range(len(JOINTS)))
        fit = _robust_fit(target, exchanged(source, flipped))
    return PairFit(T_target_source=fit.T_target_source, fit=fit), flipped


def _robust_fit(target: FloatArray, source: FloatArray) -> RobustFit:
    shared = np.isfinite(target).all(axis=2) & np.isfinite(source).all(axis=2)
    return estimate_rigid_transform_robustly(source[shared], target[shared])


def _mean_distance(a: FloatArray, b: FloatArray) -> FloatArray:
    """Mean distance [m] of the known joints in each frame, NaN if there are none."""
    return nan_mean(np.linalg.norm(a - b, axis=2), axis=1)


def _median(pair: PairFit) -> float:
    return float(np.median(pair.fit.residuals))
