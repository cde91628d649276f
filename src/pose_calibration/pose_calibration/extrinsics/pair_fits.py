"""Initial extrinsics: pairwise, then along the pairs with the most common frames.

A tracker that sees a person from behind assumes that the person faces it, and swaps left and right:
such frames are detected and corrected first.
"""

import numpy as np
from numpy.typing import NDArray

from pose_calibration.geometry.rigid_transform import (
    CalibrationError,
    RobustFit,
    estimate_rigid_transform_robustly,
)
from pose_core.api import FloatArray, transformed
from pose_core.finite_numbers import are_known, nan_mean
from pose_core.joints import JOINTS, OTHER_SIDE

LATERAL = [index for index, other in enumerate(OTHER_SIDE) if other != index]
ALL = list(range(len(JOINTS)))
MIDDLE = [index for index, other in enumerate(OTHER_SIDE) if other == index]
FLIPPED_BELOW = 0.6  # [-] largest ratio of the distances with swapped and with original sides
FLIPPED_ABOVE_M = 0.08  # [m] below this distance with original sides nothing is swapped
ROUNDS = 3  # [-] iterations of fitting and swapping


def exchanged(positions: FloatArray, flipped: NDArray[np.bool_]) -> FloatArray:
    """Skeletons (n, 15, 3) with left and right swapped where ``flipped`` (n,)."""
    return np.where(flipped[:, None, None], positions[:, OTHER_SIDE], positions)


def find_flips(view: FloatArray, other: FloatArray) -> NDArray[np.bool_]:
    """Mask of the frames in which another view has left and right swapped, (n,).

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


def fit_pair(target: FloatArray, source: FloatArray) -> tuple[RobustFit, NDArray[np.bool_]]:
    """Fit one view to another, with left and right swapped where that agrees better.

    Three initial fits are tried: from all joints, from the midline, which has no sides, and with
    all sides swapped. The one that ends with the smallest median distance is returned.

    Args:
        target: Joints [m] in the target's frame, (n, 15, 3), NaN where unknown.
        source: The same in the source's frame.

    Returns:
        The fit and a mask of the source's frames whose sides were swapped, (n,).

    Raises:
        CalibrationError: If the joints do not determine it.
    """
    best: tuple[RobustFit, NDArray[np.bool_]] | None = None
    failure: CalibrationError | None = None
    for joints, swapped in ((ALL, False), (MIDDLE, False), (ALL, True)):
        try:
            found = _fit_from(target, source, joints, np.full(len(source), swapped))
        except CalibrationError as error:
            failure = failure or error
            continue
        if best is None or found[0].median < 0.9 * best[0].median:
            best = found
        is_close = best[0].median < FLIPPED_ABOVE_M and np.mean(best[0].weights > 0.0) > 0.9
        if is_close and not best[1].any():
            break  # nothing swapped, hardly an outlier: no other initial fit can be better
    if best is None:
        raise failure or CalibrationError("found no matched joints")
    return best


def spanning_transforms(
    positions: FloatArray, shared_frames: NDArray[np.int_], minimum_frames: int
) -> tuple[dict[int, FloatArray], dict[int, int], FloatArray]:
    """Poses of all sensors linked to the first, along the pairs with the most common frames.

    Args:
        positions: Joints [m], each in its sensor's frame, (frames, sensors, 15, 3).
        shared_frames: Number of common frames of each pair, (sensors, sensors).
        minimum_frames: Common frames required for a link.

    Returns:
        ``T_first_sensor`` by index of the linked sensors; the partner of each sensor; and the
        positions with swapped sides corrected.

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


def _fit_from(
    target: FloatArray, source: FloatArray, joints: list[int], flipped: NDArray[np.bool_]
) -> tuple[RobustFit, NDArray[np.bool_]]:
    fit = _robust_fit(target[:, joints], exchanged(source, flipped)[:, joints])
    for _ in range(ROUNDS):
        now = find_flips(target, transformed(fit.T_target_source, source))
        if joints is ALL and (now == flipped).all():
            break
        flipped, joints = now, ALL
        fit = _robust_fit(target, exchanged(source, flipped))
    return fit, flipped


def _robust_fit(target: FloatArray, source: FloatArray) -> RobustFit:
    shared = are_known(target + source)
    return estimate_rigid_transform_robustly(source[shared], target[shared])


def _mean_distance(a: FloatArray, b: FloatArray) -> FloatArray:
    """Mean distance [m] of the known joints in each frame, NaN if there are none."""
    return nan_mean(np.linalg.norm(a - b, axis=2), axis=1)
