"""Curves for plots: an angle of one body over time, in degrees.

Pitch and yaw are those of zhang2015's figures 8 and 9, in map, computed in the same way for every
source; roll needs degrees of freedom (:mod:`pose_evaluation.limb_attitude`). Yaw is shown from 0°
to 360°: 180° is towards the first camera, where arms mostly point, so that the curve wraps in the
opposite direction. The flexion of a limb that points sideways is undefined and left out
(docs/conventions.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.api import ANGLES, ROOT_DOF, FloatArray, joint_angles, without_sideways_flexion
from pose_core.joints import JOINT_INDEX
from pose_evaluation.limb_attitude import (
    LIMBS,
    limb_attitude,
    limb_roll,
    model_of,
    segment_rotations,
)
from pose_evaluation.stability import BONES
from pose_evaluation.tables import readable
from pose_view.snapshot import BodySnapshot

SEGMENTS: tuple[str, ...] = tuple(sorted(LIMBS, key=lambda limb: limb.startswith("left")))
"""The limbs, the right side first."""
HALF_TURN = 180.0  # [°]


@dataclass(frozen=True, kw_only=True)
class BodyTrack:
    """Recent history of one body, oldest first."""

    times_s: FloatArray  # (n,) [s] after time zero
    joints: FloatArray  # (n, 15, 3) [m] in map
    dof_names: tuple[str, ...] = ()
    dof: FloatArray | None = None  # (n, d) [m] or [rad]
    is_occluded: NDArray[np.bool_] | None = None  # (n, 15) to the first camera; None without one


def titles(dof_names: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Titles of all curves of a body with these degrees of freedom."""
    return (
        *(f"{angle}: {readable(s)}" for angle in ("Pitch", "Yaw") for s in SEGMENTS),
        *(f"Roll: {readable(s)}" for s in SEGMENTS if model_of(dof_names)),
        *(readable(name).capitalize() for name in ANGLES),
        *(f"Model: {readable(name)}" for name in dof_names[ROOT_DOF:]),
    )


def curve(title: str, track: BodyTrack) -> FloatArray:
    """The values of a curve [deg], shape (n,); NaN where it is undefined."""
    kind, _, name = title.partition(": ")
    name = name.replace(" ", "_")
    if kind in ("Pitch", "Yaw"):
        pitch, yaw = limb_attitude(track.joints, name)
        return np.degrees(pitch) if kind == "Pitch" else np.degrees(yaw) % 360.0
    if kind in ("Roll", "Model"):
        if track.dof is None or (kind == "Model" and name not in track.dof_names):
            return np.full(len(track.joints), np.nan)
        if kind == "Model":
            return np.degrees(track.dof[:, track.dof_names.index(name)])
        return np.degrees(limb_roll(segment_rotations(track.dof_names, track.dof, name)))
    angles = without_sideways_flexion(joint_angles(track.joints))
    return np.degrees(angles[title.lower().replace(" ", "_")])


def occlusion(title: str, track: BodyTrack, grid: FloatArray) -> NDArray[np.bool_]:
    """When the first camera does not track both ends of a curve's limb, at times [s], (m,)."""
    kind, _, name = title.partition(": ")
    limb = name.replace(" ", "_")
    if kind not in ("Pitch", "Yaw", "Roll") or limb not in BONES or track.is_occluded is None:
        return np.zeros(len(grid), bool)
    ends = [JOINT_INDEX[joint] for joint in BONES[limb]]
    is_hidden = track.is_occluded[:, ends].any(axis=1)
    return np.interp(grid, track.times_s, is_hidden, left=0.0, right=0.0) > 0.5


def on_grid(times: FloatArray, values: FloatArray, grid: FloatArray, gap: float) -> FloatArray:
    """Interpolate values linearly at other times; NaN outside and within gaps.

    Args:
        times: Times of the values [s], ascending, shape (n,).
        values: Angles [°], shape (n,); a step of more than 180° counts as a wrap.
        grid: Times of the result [s], shape (m,).
        gap: Longest interval that is interpolated [s].
    """
    if len(times) < 2:
        return np.full(len(grid), np.nan)
    after = np.clip(np.searchsorted(times, grid), 1, len(times) - 1)
    found = np.interp(grid, times, values)
    wraps = np.abs(values[after] - values[after - 1]) > HALF_TURN
    lost = wraps | (times[after] - times[after - 1] > gap) | (grid < times[0]) | (grid > times[-1])
    found[lost] = np.nan
    return found


def track_of(snapshots: Sequence[BodySnapshot], zero_ns: int = 0) -> BodyTrack:
    """Convert snapshots of one body to a track; degrees of freedom only if all have the same."""
    first = snapshots[0].dof if snapshots else None
    names = first.names if first is not None else ()
    dof = [s.dof.position for s in snapshots if s.dof is not None and s.dof.names == names]
    occluded = [s.is_occluded for s in snapshots if s.is_occluded is not None]
    complete = bool(names) and len(dof) == len(snapshots)
    return BodyTrack(
        times_s=np.array([s.stamp_ns - zero_ns for s in snapshots], float) * 1e-9,
        joints=np.array([s.joints for s in snapshots]).reshape(-1, len(JOINT_INDEX), 3),
        dof_names=names if complete else (),
        dof=np.array(dof) if complete else None,
        is_occluded=np.array(occluded) if occluded and len(occluded) == len(snapshots) else None,
    )
