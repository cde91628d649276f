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

from pose_core.arrays import FloatArray
from pose_core.people.assignment import assign
from pose_core.people.distances import joint_distances
from pose_core.people.person_track import PersonTrack
from pose_core.streams.samples import SkeletonSample

GATE_M = 0.35  # [m] mean distance of the joints from their predicted positions, under a known id
SPEED_CHANGE = 4.0  # [m/s] a change of speed that the prediction lacks; it widens this gate while
WIDER_FROM_S, WIDER_TO_S = 0.034, 0.2  # [s] the joints' age grows from one to the other
OTHER_ID_GATE_M = 0.25  # [m] the same under any other id: people pass each other at arm's length
SAME_ID_M = 0.1  # [m] by which an id speaks for the person who had it, and against others
ID_HOLDS_S = 0.5  # [s] for which a sensor's id counts
UNOBSERVED_M = 0.1  # [m] advantage of a confirmed person who is seen


def associate(
    tracks: Sequence[PersonTrack],
    frame: Sequence[SkeletonSample],
    positions: FloatArray,
    stamp_ns: int,
) -> tuple[list[tuple[int, int]], NDArray[np.bool_]]:
    """Assign a frame's skeletons to persons.

    Args:
        tracks: The persons in view.
        frame: All skeletons that a sensor saw at one instant.
        positions: Their joints in the common frame [m], shape (skeletons, 15, 3).
        stamp_ns: The instant [ns].

    Returns:
        Pairs of indices (track, skeleton), and whether the skeleton has left and right swapped,
        shape (tracks, skeletons).
    """
    if not tracks:
        return [], np.empty((0, len(frame)), np.bool_)
    predicted = np.stack([track.predicted(stamp_ns) for track in tracks])
    distance, is_mirrored = joint_distances(predicted, positions)
    has_other_id = _other_ids(tracks, frame, stamp_ns)
    cost = distance + SAME_ID_M * has_other_id
    cost[distance > np.where(has_other_id, OTHER_ID_GATE_M, _gates_m(tracks, stamp_ns))] = np.inf
    is_observed = [track.is_observed(stamp_ns) for track in tracks]
    cost[np.logical_not(is_observed)] += UNOBSERVED_M
    # A skeleton rather begins a track than it pushes another one off its own.
    unassigned = np.full((len(frame), len(frame)), np.inf)
    np.fill_diagonal(unassigned, cost[np.isfinite(cost)].max(initial=GATE_M) + UNOBSERVED_M)
    pairs = assign(np.vstack([cost, unassigned]))
    return [(row, column) for row, column in pairs if row < len(tracks)], is_mirrored


def _gates_m(tracks: Sequence[PersonTrack], stamp_ns: int) -> FloatArray:
    """Gate of each track under its known id [m], (tracks, 1)."""
    age_s = np.array([track.age_s(stamp_ns) for track in tracks])
    extra_s = np.clip(age_s, WIDER_FROM_S, WIDER_TO_S) - WIDER_FROM_S
    return np.asarray(GATE_M + SPEED_CHANGE * extra_s)[:, None]


def _other_ids(
    tracks: Sequence[PersonTrack], frame: Sequence[SkeletonSample], stamp_ns: int
) -> NDArray[np.bool_]:
    """Whether a skeleton has another id than the sensor gave the person, (tracks, skeletons)."""
    is_other = np.ones((len(tracks), len(frame)), np.bool_)
    for row, track in enumerate(tracks):
        view = track.views.get(frame[0].sensor)
        if view is None or stamp_ns - view.stamp_ns > ID_HOLDS_S * 1e9:
            continue
        is_other[row] = [sample.person != view.person for sample in frame]
    return is_other
