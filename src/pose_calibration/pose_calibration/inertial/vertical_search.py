"""Search for the vertical in all directions, where the IMUs contradict the estimate without them.

A person who lies for most of the time, below a camera on the ceiling or before one that is turned
on its side, may be taken for one who stands. Then no IMU's motion fits the limbs' inclinations,
which are fitted by those about the true vertical.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from pose_calibration.clocks.motion_track import GRID_RATE, Track
from pose_calibration.inertial.imu_motion import Views, limb_ends, unexplained_share
from pose_core.api import FloatArray
from pose_core.arrays import unit_vectors
from pose_core.finite_numbers import are_known

MOST_UNEXPLAINED = (
    0.6  # [-] share of the limbs' motion left unexplained, up to which a vertical holds
)
MUCH_LESS = 0.7  # [-] times as much must be left unexplained by another one
MIN_COUNT = 100.0  # [-] independent samples of the limbs' inclinations
DIRECTIONS = unit_vectors(
    np.array([each for each in product((-1.0, 0.0, 1.0), repeat=3) if each > (0.0, 0.0, 0.0)])
)
"""(13, 3) One is within 28 degrees of any direction or its opposite, which explains as much."""


def search_vertical(
    views: Views, verticals: Mapping[str, Track], reach_s: float
) -> FloatArray | None:
    """The vertical, if the one of the views leaves far more of the limbs' motion unexplained.

    Args:
        views: Joints measured by each camera, with the vertical estimated without the IMUs.
        verticals: The vertical in each IMU, by segment.
        reach_s: Half width of the search for the IMUs' delay [s].

    Returns:
        Its direction to about 30 degrees in the reference's frame, (3,); None if the known holds.
    """
    known, _ = unexplained_share(views, verticals, reach_s)
    if known <= MOST_UNEXPLAINED:
        return None
    tried = [
        (*unexplained_share(replace(views, up=up), verticals, reach_s), up) for up in DIRECTIONS
    ]
    share, count, up = min(tried, key=lambda each: each[0])
    if count < MIN_COUNT or share > MUCH_LESS * known:
        return None
    return up if _trunk(views) @ up >= 0.0 else -up


def _trunk(views: Views) -> FloatArray:
    """The mean direction from the torso to the neck in the reference's frame, (3,)."""
    total = np.zeros(3)
    for track in views.tracks:
        if len(track.stamps) < 2:
            continue
        grid = np.arange(track.stamps[0], track.stamps[-1], 1.0 / GRID_RATE)
        start, end = limb_ends(track, "torso", grid)
        known = are_known(end - start)
        total += unit_vectors((end - start)[known]).sum(axis=0)
    return total
