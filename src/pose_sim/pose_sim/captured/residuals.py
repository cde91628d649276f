"""Errors of a real skeleton tracker, played again on another person's motion.

``uiprmd_residuals.npz`` holds what a Kinect v2 got wrong against a Vicon in UI-PRMD (see
``tables/README.md``): each joint's error over time, in axes that turn with the person, and the
posture meanwhile. A person's errors are pieces of it that begin in a posture like the person's, so
that they keep their correlation in time, between joints, and with posture.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from pose_core.joints import JOINT_INDEX
from pose_sim.captured.clips import heading, mid_hip
from pose_sim.rotations import FloatArray, about_z

PIECE_S = (0.6, 1.5)  # [s] length of a piece
BLEND_S = 0.2  # [s] in which one passes into the next
CANDIDATES = 12  # [-] moments of the nearest posture, one of which is drawn
MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class ResidualTable:
    """Repetitions of movements one after the other, n rows."""

    rate: float  # [Hz]
    postures: FloatArray  # (n, 15, 3) [m] joints from the middle of the hips, x to the front
    residuals: FloatArray  # (n, 15, 3) [m] what the tracker adds, in the same axes
    last: NDArray[np.int64]  # (n,) row at which the repetition ends


@cache
def residual_table() -> ResidualTable:
    """The table that comes with the package, and its mirror image."""
    path = resources.files("pose_sim.captured") / "tables" / "uiprmd_residuals.npz"
    with path.open("rb") as file, np.load(file) as data:
        scale = 0.001  # [m] per unit of the file
        postures, residuals = scale * data["postures"], scale * data["residuals"]
        ends, rate = data["ends"].astype(np.int64), float(data["rate"])
    count = len(postures)
    last = ends[np.searchsorted(ends, np.arange(count))]
    return ResidualTable(
        rate=rate,
        postures=np.concatenate([postures, mirrored(postures)]),
        residuals=np.concatenate([residuals, mirrored(residuals)]),
        last=np.concatenate([last, count + last]),
    )


def mirrored(vectors: FloatArray) -> FloatArray:
    """Left and right exchanged, (n, 15, 3), in axes that turn with the person."""
    order = [
        JOINT_INDEX[name.replace("left", "#").replace("right", "left").replace("#", "right")]
        for name in JOINT_INDEX
    ]
    return vectors[:, order] * MIRROR


def posture_axes(positions: FloatArray) -> FloatArray:
    """Axes that turn with the person's heading, ``R_map_person``, (n, 15, 3) to (n, 3, 3)."""
    return about_z(heading(positions))


def postures_of(positions: FloatArray) -> FloatArray:
    """Joints from the middle of the hips in the person's axes, (n, 15, 3) [m]."""
    relative = positions - mid_hip(positions)[:, None]
    return relative @ posture_axes(positions)


def resampled_residuals(positions: FloatArray, rate: float, rng: np.random.Generator) -> FloatArray:
    """A person's errors.

    Args:
        positions: True joints in map, (n, 15, 3) [m].
        rate: Of the frames [Hz].
        rng: Which pieces.

    Returns:
        What a tracker adds, in map, (n, 15, 3) [m].
    """
    table = residual_table()
    postures = postures_of(positions)
    errors = np.zeros_like(positions)
    blend = max(round(BLEND_S * rate), 1)
    at = 0
    while at < len(positions):
        row = _begin(table, postures[at], rng)
        most = (table.last[row] - row) / table.rate  # [s] to the end of the repetition
        length = max(round(min(rng.uniform(*PIECE_S), most) * rate), blend + 1)
        stop = min(at + length, len(positions))
        rows = row + np.arange(stop - at) * table.rate / rate
        piece = _between(table, np.minimum(rows, table.last[row]))
        share = np.ones(stop - at)
        if at > 0:  # the last frames of the piece before are passed over gently
            share[:blend] = np.linspace(0.0, 1.0, blend + 2)[1:-1][: stop - at]
        errors[at:stop] = (1.0 - share[:, None, None]) * errors[at:stop]
        errors[at:stop] += share[:, None, None] * piece
        if stop < len(positions):  # hold the last error under the next piece's beginning
            errors[stop : stop + blend] = piece[-1]
        at = stop
    return np.einsum("nij,nkj->nki", posture_axes(positions), errors)


def _begin(table: ResidualTable, posture: FloatArray, rng: np.random.Generator) -> int:
    """A row of about the same posture."""
    distance = np.linalg.norm(table.postures - posture, axis=2).sum(axis=1)
    nearest = np.argpartition(distance, CANDIDATES)[:CANDIDATES]
    return int(rng.choice(nearest))


def _between(table: ResidualTable, rows: FloatArray) -> FloatArray:
    """Residuals at rows that are no integers."""
    low = np.floor(rows).astype(np.int64)
    share = (rows - low)[:, None, None]
    above = np.minimum(low + 1, len(table.residuals) - 1)
    return (1.0 - share) * table.residuals[low] + share * table.residuals[above]
