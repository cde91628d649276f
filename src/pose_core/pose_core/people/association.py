r"""Data association: which of the persons in view each skeleton of a frame is of.

Each frame is assigned as a whole (global nearest neighbour; Bar-Shalom, Willett, Tian: *Tracking
and Data Fusion*, 2011, ch. 6): the assignment of skeletons to persons that minimises

.. math:: \sum_i d(\hat p_i, s_i) + e(i, s_i)

with the mean distance :math:`d` of the joints from their predicted positions, and :math:`e` for a
sensor's id that speaks against it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from pose_core.arrays import FloatArray
from pose_core.joints import OTHER_SIDE
from pose_core.people.person_track import PersonTrack
from pose_core.streams.samples import SkeletonSample

GATE_M = 0.35  # [m] mean distance of the joints from their predicted positions, under a known id
SPEED_CHANGE = 4.0  # [m/s] a change of speed that the prediction lacks; it widens this gate while
WIDER_FROM_S, WIDER_TO_S = 0.034, 0.2  # [s] the joints' age grows from one to the other
OTHER_ID_GATE_M = 0.25  # [m] the same under any other id: people pass each other at arm's length
ROUGH_GATE = 2.0  # [-] of the median distance of two rough views, by which the gates are wider
SAME_ID_M = 0.1  # [m] by which an id speaks for the person who had it, and against others
ID_HOLDS_S = 0.5  # [s] for which a sensor's id counts
UNOBSERVED_M = 0.1  # [m] advantage of a confirmed person who is seen

GROSS_ERROR_M = 1.0  # [m] a joint farther away is as wrong as one at this distance
MIN_JOINTS = 4  # [-] in common
MIRRORED_M = 0.05  # [m] by which exchanged sides must agree better
FORBIDDEN = 1e3  # in place of an infinite cost, with which no assignment may exist


def associate(
    tracks: Sequence[PersonTrack],
    frame: Sequence[SkeletonSample],
    positions: FloatArray,
    stamp_ns: int,
    rough_m: float,
) -> tuple[list[tuple[int, int]], NDArray[np.bool_]]:
    """Assign a frame's skeletons to persons.

    Args:
        tracks: The persons in view.
        frame: All skeletons that a sensor saw at one instant.
        positions: Their joints in the common frame [m], shape (skeletons, 15, 3).
        stamp_ns: The instant [ns].
        rough_m: Distance [m] of a joint in two views of trackers that guess distances.

    Returns:
        Pairs of indices (track, skeleton), and whether the skeleton has left and right swapped,
        shape (tracks, skeletons).
    """
    if not tracks:
        return [], np.empty((0, len(frame)), np.bool_)
    predicted = np.stack([track.predicted(stamp_ns) for track in tracks])
    distance, is_mirrored = joint_distances(predicted, positions)
    # Whether a skeleton has another id than the sensor gave the person.
    has_other_id = np.ones(distance.shape, np.bool_)
    for row, track in enumerate(tracks):
        view = track.views.get(frame[0].sensor)
        if view is not None and stamp_ns - view.stamp_ns <= ID_HOLDS_S * 1e9:
            has_other_id[row] = [sample.person != view.person for sample in frame]
    cost = distance + SAME_ID_M * has_other_id
    age_s = np.array([track.age_s(stamp_ns) for track in tracks])
    extra_s = np.clip(age_s, WIDER_FROM_S, WIDER_TO_S) - WIDER_FROM_S
    gates_m = (GATE_M + SPEED_CHANGE * extra_s)[:, None]
    gates_m = np.where(has_other_id, OTHER_ID_GATE_M, gates_m) + ROUGH_GATE * rough_m
    cost[distance > gates_m] = np.inf
    is_observed = [track.is_observed(stamp_ns) for track in tracks]
    cost[np.logical_not(is_observed)] += UNOBSERVED_M
    # A skeleton rather begins a track than it pushes another one off its own.
    unassigned = np.full((len(frame), len(frame)), np.inf)
    np.fill_diagonal(unassigned, cost[np.isfinite(cost)].max(initial=GATE_M) + UNOBSERVED_M)
    pairs = assign(np.vstack([cost, unassigned]))
    return [(row, column) for row, column in pairs if row < len(tracks)], is_mirrored


def joint_distances(expected: FloatArray, seen: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Mean distance of the joints of each expected person and each seen skeleton.

    A tracker that sees a person from behind exchanges left and right: the better labelling counts.

    Args:
        expected: (p, 15, 3) [m]; NaN where unknown.
        seen: (s, 15, 3) [m] in the same frame; NaN where unknown.

    Returns:
        (p, s) [m], each joint :data:`GROSS_ERROR_M` at most; infinite with too few joints in
        common.
        And whether the sides are exchanged, (p, s).
    """
    both = np.concatenate([seen, seen[:, OTHER_SIDE]])
    distance = np.linalg.norm(expected[:, None] - both[None], axis=3)
    known = np.isfinite(distance)
    count = known.sum(axis=2)
    total = np.where(known, np.minimum(distance, GROSS_ERROR_M), 0.0).sum(axis=2)
    mean = np.where(count >= MIN_JOINTS, total / np.maximum(count, 1), np.inf)
    plain, mirrored = mean[:, : len(seen)], mean[:, len(seen) :]
    is_mirrored = mirrored + MIRRORED_M < plain
    return np.where(is_mirrored, mirrored, plain), is_mirrored


def assign(cost: FloatArray) -> list[tuple[int, int]]:
    """Pairs of indices with the least sum of costs, sorted; infinite ones are never paired.

    As many pairs as can be are made, and of these the cheapest.

    Args:
        cost: (rows, columns), infinite where a pair is out of the question.
    """
    rows, columns = linear_sum_assignment(np.where(np.isfinite(cost), cost, FORBIDDEN))
    is_allowed = np.isfinite(cost[rows, columns])
    return list(zip(rows[is_allowed].tolist(), columns[is_allowed].tolist(), strict=True))
