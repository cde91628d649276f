"""Balls at a drawn body's joints: colour shows the source, size and paleness the uncertainty.

A joint's degrees of freedom are those that determine its position: of the limb that it ends, else
of the joint itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pose_core.api import Source
from pose_core.joints import JOINTS, SIDES, TrackingState
from pose_view.body.measures import BodyMeasures
from pose_view.mesh import Mesh, ellipsoid
from pose_view.snapshot import BodySnapshot, DofSnapshot

# Okabe and Ito (2008): distinguishable with any colour vision.
LEGEND: Mapping[str, tuple[tuple[int, int, int], str]] = {
    "tracked": ((0, 114, 178), "tracked by a camera"),
    "inferred": ((230, 159, 0), "inferred by a camera (occluded)"),
    "imu": ((0, 158, 115), "from an IMU"),
    "predicted": ((204, 51, 120), "predicted, nothing measures it"),
}
COLORS = {source: color for source, (color, _) in LEGEND.items()}
SEEN = {
    TrackingState.TRACKED: "tracked",
    TrackingState.INFERRED: "inferred",
    TrackingState.NOT_TRACKED: "predicted",
}
"""The key of these of a joint that is measured by cameras only."""
PALE = np.array([238.0, 238.0, 238.0])
CERTAIN, UNCERTAIN = np.radians(2.0), np.radians(20.0)  # [rad] standard deviations
MAX_PALENESS = 0.75  # [-]
MAX_GROWTH = 0.25  # [-] of the radius
IMU_SHARE = 0.5  # [-] weight above which a joint counts as measured by an IMU


class Ball(NamedTuple):
    """A joint's ball."""

    part: str  # to which it is fixed
    half_axes: tuple[float, float, float]  # [m] for an adult of 1.75 m
    dof: tuple[str, ...]  # the joint's degrees of freedom


PELVIS_TURNS = ("pelvis_rotation_x", "pelvis_rotation_y", "pelvis_rotation_z")
WAIST_BENDS = ("waist_flexion", "waist_lateral_bending")
BALLS: Mapping[str, Ball] = {
    "head": Ball("head", (0.104, 0.084, 0.018), ("neck_flexion", "neck_lateral_bending")),
    "neck": Ball("head", (0.060, 0.060, 0.020), (*WAIST_BENDS, *PELVIS_TURNS[:2])),
    "torso": Ball("thorax", (0.103, 0.0, 0.028), PELVIS_TURNS),  # sideways: as wide as the waist
    **{
        f"{side}_{joint}": Ball(
            f"{side}_{limb}", (radius,) * 3, tuple(name.replace("*", side) for name in dof)
        )
        for side in SIDES
        for joint, limb, radius, dof in (
            ("shoulder", "upper_arm", 0.061, ("waist_rotation", "pelvis_rotation_z")),
            ("elbow", "forearm", 0.046, ("*_shoulder_flexion", "*_shoulder_abduction")),
            ("hand", "forearm", 0.034, ("*_elbow_flexion",)),
            ("hip", "thigh", 0.098, ("pelvis_rotation_z",)),
            ("knee", "shank", 0.062, ("*_hip_flexion", "*_hip_abduction")),
            ("foot", "shank", 0.044, ("*_knee_flexion",)),
        )
    },
}
BANDS = ("head", "neck", "torso")
"""Drawn as bands around the body: only their height increases."""
STEPS = 8  # [-] drawn levels of uncertainty


@dataclass(frozen=True, kw_only=True)
class JointMark:
    """Appearance of one joint's ball."""

    color: tuple[int, int, int]
    growth: float  # [-] 1: certain


def make_balls(measures: BodyMeasures) -> dict[str, Mesh]:
    """The surface of each joint's ball, about the joint, in the axes of its part."""
    balls = {}
    for joint, ball in BALLS.items():
        x, y, z = (measures.size * axis for axis in ball.half_axes)
        if joint == "torso":
            y = max(measures.shoulders / 2.0, 0.15 * measures.size) * 0.70 + 0.015 * measures.size
        balls[joint] = ellipsoid((x, y, z))
    return balls


def ball_place(joint: str, measures: BodyMeasures) -> tuple[float, float, float]:
    """Position of a joint in the axes of its ball's part [m]."""
    side, _, end = joint.partition("_")
    lengths = {"hand": measures.forearm, "foot": measures.shank}.get(end)
    if lengths is not None:
        return 0.0, 0.0, -lengths[SIDES.index(side)]
    return 0.0, 0.0, measures.neck if joint == "head" else 0.0


def joint_marks(body: BodySnapshot) -> dict[str, JointMark]:
    """Appearance of all balls of a body."""
    marks = {}
    rows = _rows(body.dof)
    for joint, state in zip(JOINTS, body.tracking_state, strict=True):
        doubt = 0.0
        if body.dof is not None and rows[joint]:
            stddev = float(np.max(body.dof.stddev[rows[joint]]))
            doubt = float(np.clip((stddev - CERTAIN) / (UNCERTAIN - CERTAIN), 0.0, 1.0))
            doubt = round(doubt * STEPS) / STEPS
        color = np.array(COLORS[_source(TrackingState(state), body.dof, rows[joint])])
        paleness = MAX_PALENESS * doubt
        red, green, blue = np.rint((1.0 - paleness) * color + paleness * PALE).astype(int).tolist()
        marks[joint] = JointMark(color=(red, green, blue), growth=1.0 + MAX_GROWTH * doubt)
    return marks


def _rows(dof: DofSnapshot | None) -> dict[str, list[int]]:
    """Indices of each joint's degrees of freedom in the estimate."""
    if dof is None:
        return {joint: [] for joint in JOINTS}
    index = {name: row for row, name in enumerate(dof.names)}
    return {joint: [index[n] for n in BALLS[joint].dof if n in index] for joint in JOINTS}


def _source(tracking: TrackingState, dof: DofSnapshot | None, rows: list[int]) -> str:
    if dof is None or not rows:
        return SEEN[tracking]
    sources = dof.source[rows]
    if np.all(sources == Source.PREDICTED):
        return "predicted"
    if float(np.mean(dof.weight_imu[rows])) >= IMU_SHARE or np.all(sources == Source.IMU):
        return "imu"
    return SEEN[tracking]
