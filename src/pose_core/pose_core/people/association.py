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

from pose_core.people.assignment import assign
from pose_core.people.distances import joint_distances
from pose_core.people.person_track import PersonTrack, Presence
from pose_core.streams.samples import FloatArray, SkeletonSample

GATE_M = 0.55  # [m] mean distance of the joints from their predicted positions
GATE_SPEED = 1.5  # [m/s] by which the gate widens while no sensor sees where a person is
WIDEST_GATE_M = 0.95  # [m]
SAME_ID_M = 0.1  # [m] by which an id speaks for the person who had it, and against others
ID_HOLDS_S = 2.0  # [s] for which a sensor's id counts
TENTATIVE_M = 0.1  # [m] advantage of a confirmed person over a tentative one


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
    predicted = np.stack([track.expected(stamp_ns) for track in tracks])
    distance, is_mirrored = joint_distances(predicted, positions)
    cost = distance.copy()
    for row, track in enumerate(tracks):
        gate = min(GATE_M + GATE_SPEED * track.unplaced_s(stamp_ns), WIDEST_GATE_M)
        cost[row, distance[row] > gate] = np.inf
        cost[row] += TENTATIVE_M * (track.presence is Presence.TENTATIVE)
    return assign(cost + _id_costs(tracks, frame, stamp_ns)), is_mirrored


def _id_costs(
    tracks: Sequence[PersonTrack], frame: Sequence[SkeletonSample], stamp_ns: int
) -> FloatArray:
    """Cost of an id that another person had [m], shape (tracks, skeletons)."""
    costs = np.zeros((len(tracks), len(frame)))
    for row, track in enumerate(tracks):
        view = track.views.get(frame[0].sensor)
        if view is None or stamp_ns - view.stamp_ns > ID_HOLDS_S * 1e9:
            continue
        for column, sample in enumerate(frame):
            costs[row, column] = 0.0 if sample.person == view.person else SAME_ID_M
    return costs
