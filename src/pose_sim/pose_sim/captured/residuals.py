"""Errors of a real skeleton tracker, applied to another person's motion.

``uiprmd_residuals.npz`` contains the errors of a Kinect v2 relative to a Vicon in UI-PRMD (see
``tables/README.md``): each joint's error over time in axes fixed to the person, and the posture. A
person's errors are resampled as pieces that start in a posture similar to the person's, which
preserves their correlation in time, between joints, and with posture.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import OTHER_SIDE
from pose_io.arrays import IntArray
from pose_sim.captured.clips import heading, mid_hip
from pose_sim.rotations import about_z

PIECE_S = (0.6, 1.5)  # [s] duration of a piece
BLEND_S = 0.2  # [s] cross-fade between pieces
CANDIDATES = 12  # [-] rows of the nearest postures, one of which is drawn
MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class ResidualTable:
    """Residuals of repeated movements, concatenated to n rows."""

    rate: float  # [Hz]
    postures: FloatArray  # (n, 15, 3) [m] joints from the middle of the hips, x to the front
    residuals: FloatArray  # (n, 15, 3) [m] errors of the tracker, in the same axes
    last: IntArray  # (n,) row at which the repetition ends


@cache
def residual_table() -> ResidualTable:
    """The package's table and its mirror image."""
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
    """Mirror vectors left to right, (n, 15, 3), in axes fixed to the person."""
    return vectors[:, OTHER_SIDE] * MIRROR


def posture_axes(positions: FloatArray) -> FloatArray:
    """Axes of the person's heading, ``R_map_person``, (n, 15, 3) to (n, 3, 3)."""
    return about_z(heading(positions))


def postures_of(positions: FloatArray) -> FloatArray:
    """Joints relative to the middle of the hips in the person's axes, (n, 15, 3) [m]."""
    relative = positions - mid_hip(positions)[:, None]
    return relative @ posture_axes(positions)


def resampled_residuals(positions: FloatArray, rate: float, rng: np.random.Generator) -> FloatArray:
    """Resample tracker errors for a person's motion.

    Args:
        positions: True joints in map, (n, 15, 3) [m].
        rate: Rate of the frames [Hz].
        rng: Random generator that draws the pieces.

    Returns:
        The tracker's errors in map, (n, 15, 3) [m].
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
        if at > 0:  # cross-fade with the last frames of the previous piece
            share[:blend] = np.linspace(0.0, 1.0, blend + 2)[1:-1][: stop - at]
        errors[at:stop] = (1.0 - share[:, None, None]) * errors[at:stop]
        errors[at:stop] += share[:, None, None] * piece
        if stop < len(positions):  # hold the last error during the cross-fade with the next piece
            errors[stop : stop + blend] = piece[-1]
        at = stop
    return np.einsum("nij,nkj->nki", posture_axes(positions), errors)


def _begin(table: ResidualTable, posture: FloatArray, rng: np.random.Generator) -> int:
    """Draw a row of a similar posture."""
    distance = np.linalg.norm(table.postures - posture, axis=2).sum(axis=1)
    nearest = np.argpartition(distance, CANDIDATES)[:CANDIDATES]
    return int(rng.choice(nearest))


def _between(table: ResidualTable, rows: FloatArray) -> FloatArray:
    """Residuals interpolated at fractional rows."""
    low = np.floor(rows).astype(np.int64)
    share = (rows - low)[:, None, None]
    above = np.minimum(low + 1, len(table.residuals) - 1)
    return (1.0 - share) * table.residuals[low] + share * table.residuals[above]
