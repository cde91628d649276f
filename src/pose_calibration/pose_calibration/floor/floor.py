r"""Estimation of the world frame ``map`` from standing and walking persons.

``map`` has z up and the floor at z = 0; x is the horizontal part of the reference sensor's
viewing direction, and the origin lies on the floor below the reference sensor. If that sensor looks
straight down, x is the horizontal direction of its image's upper edge; if up, of the lower one.

The vertical follows from the person's balance: the centre of mass of somebody on the feet is on
average above them, or above the lower one while the other is raised. Then it is corrected by the
heights of the standing feet, which lie on a plane. With :math:`h` the height of a foot at the
horizontal position :math:`(x, y)` along the initial vertical:

.. math:: h = a x + b y + c

and :math:`(a, b)` is combined with the body's estimate :math:`(0, 0)` by the inverse covariances:
feet at one place leave the body's estimate, feet of a walking person correct it, and feet that are
on no plane, as those of a climbing person, hardly do.

References:
    Winter (2009), Biomechanics and Motor Control of Human Movement, 4th ed.: figure 4.1 and
    table 4.1, lengths and masses of segments.
"""

from dataclasses import dataclass

import numpy as np

from pose_calibration.floor.gravity import Gravity
from pose_core.api import FloatArray, FloorEstimate, rigid_transform
from pose_core.arrays import rows_of, unit_vectors
from pose_core.finite_numbers import are_known, robust_stddev
from pose_core.joints import JOINT_INDEX, JOINT_PAIRS, JOINTS

ANKLE_HEIGHT_M = 0.07  # [m] 0.039 of a stature of 1.75 m (Winter)
FOOT_STDDEV_M = 0.03  # [m] scatter of a standing ankle's measured height between positions
ANKLE_HEIGHT_STDDEV_M = 0.02  # [m] between people, shoes and sensors
FOOT_SLOPE_STDDEV = np.radians(2.5)  # [rad] systematic error of ankle heights with the distance
WEAK_PRIOR = np.radians(20.0)  # [rad] of the slope, if the feet alone do not determine it
BODY_STDDEV = np.radians(2.0)  # [rad] error of the vertical by a person's balance
AHEAD_OF_ANKLES_M = 0.06  # [m] horizontal distance of the centre of mass from the ankles
MASS_SHARES = {
    "head": 0.081,
    "shoulder": 0.140,
    "elbow": 0.019,
    "hand": 0.015,
    "hip": 0.181,
    "knee": 0.070,
    "foot": 0.035,
}
"""[-] The body's mass, shared among the joints at the ends of its segments, as their centres of
mass are (Winter)."""
MOST_MASS = 0.9  # [-] share that must be seen
LEVEL_STDDEV = np.radians(10.0)  # [rad] of the viewing direction, without other information
MAX_TILT = np.radians(60.0)  # [rad] of the sensor, unless the person walks: otherwise one may lie
MAX_INCLINATION = np.radians(60.0)  # [rad] of the trunk from its usual direction
FIRST_UPS = np.concatenate([np.eye(3), -np.eye(3)])  # (6, 3) of a sensor in any position
WALKED_M = 0.7  # [m] along any axis of the sensor
STEP_M = 0.35  # [m] between the ankles
LOOKING_SIDEWAYS = 0.1  # [-] horizontal part of the viewing direction that gives x of map
LEVEL_M = 0.15  # [m] within which the lower ankle is for half of the time
MIN_SHARE_IN_STEP = 0.1  # [-] of the frames
BENT = np.radians(75.0)  # [rad] of knees and hips, up to which a person stands; seated 90°
RAISED_M = 0.2  # [m] from which on the lower ankle carries more; from twice that on, all
MIN_SHARE_ON_FEET = 0.2  # [-] of the frames in which the legs are seen
MIN_SHARE_STANDING = 0.3  # [-] of these frames, in balance; otherwise the person may lie
MAX_SWAY = np.radians(25.0)  # [rad] from the median, of the directions that count
FEET_COUNT_BELOW = 0.85  # [-] of the body's deviation, below which feet are named as a source
MIN_UPRIGHT_FRAMES = 15  # [-]
CELL_M = 0.25  # [m] feet in one cell of the floor count as one observation
RARE = 0.05  # [-] of the frames, by whose share the least visited cells are left out
HUBER_M = 0.04  # [m] larger deviations are feet in the air or wrong joints
PLANE_SCATTER_M = 0.06  # [m] of standing feet about their plane; 0.01 to 0.04 on a floor
MAX_DISTANCE = 6.0  # [-] squared, of the feet's slope from the body's, over its variance
ITERATIONS = 20
BALANCE_ITERATIONS = 5
MOST_FRAMES = 20_000  # [-] in which the balance is looked at


KNOWN_MOUNTING = "known mounting"
UPRIGHT_BODY = "upright body"
FEET = "walking feet"
LEVEL_SENSOR = "sensor assumed level"


@dataclass(frozen=True, kw_only=True)
class KnownMounting:
    """Known tilt and height of the reference sensor; None where they are estimated."""

    tilt: float | None = None  # [rad] of the viewing direction, positive downwards
    height: float | None = None  # [m] above the floor


def estimate_floor(
    positions: FloatArray, mounting: KnownMounting | None = None, gravity: Gravity | None = None
) -> FloorEstimate:
    """Estimate ``map`` from skeletons.

    Args:
        positions: Joints [m] in the reference sensor's optical frame, shape (..., 15, 3), NaN where
            unknown, in any order. The sensor is assumed to be upright or upside down (hung from the
            ceiling; y up), tilted up to 60 degrees, unless the person walks.
        mounting: Known values, which replace the estimates.
        gravity: The vertical from another source; it replaces the estimate from the body.
    """
    mounting = mounting or KnownMounting()
    positions = positions.reshape(-1, *positions.shape[-2:])
    up, up_stddev, source = _first_guess(positions, mounting, gravity)
    feet = positions[:, JOINT_PAIRS["foot"]]
    height, slope_stddev, height_stddev = 1.0, up_stddev, np.inf  # without feet, that of a table
    # The lower foot of each frame is the standing one.
    feet = feet[are_known(feet).all(axis=1)]
    standing = feet[np.arange(len(feet)), np.argmin(feet @ up, axis=1)]
    if len(standing) >= MIN_UPRIGHT_FRAMES:
        plane = _plane(standing, up, up_stddev)
        may_lie = gravity is None and source == UPRIGHT_BODY and up_stddev > BODY_STDDEV
        # Nobody was seen on the feet: those of a seated person stay at a place, hidden and guessed.
        level = standing - np.outer(standing @ up, up)
        way_m = np.ptp(np.percentile(level, (5, 95), axis=0), axis=0).max()
        is_plane_known = way_m >= WALKED_M and plane[2] < FEET_COUNT_BELOW * up_stddev
        if may_lie or (source == LEVEL_SENSOR and not is_plane_known):
            plane = _plane(standing, up, up_stddev, have_walked=False)
        up, sole, slope_stddev, sole_stddev = plane
        height = ANKLE_HEIGHT_M - sole
        height_stddev = float(np.hypot(sole_stddev, ANKLE_HEIGHT_STDDEV_M))
        is_named = source == KNOWN_MOUNTING or FEET in source
        if not is_named and slope_stddev < FEET_COUNT_BELOW * up_stddev:
            source = f"{source}, {FEET}"
    if mounting.height is not None:
        height, height_stddev = mounting.height, 0.0
    return FloorEstimate(
        T_map_reference=_map_frame(up, height),
        source=source,
        up_stddev=slope_stddev,
        height_stddev=height_stddev,
    )


def _first_guess(
    positions: FloatArray, mounting: KnownMounting, gravity: Gravity | None
) -> tuple[FloatArray, float, str]:
    if mounting.tilt is not None:
        up = np.array([0.0, -np.cos(mounting.tilt), -np.sin(mounting.tilt)])
        return up, 0.0, KNOWN_MOUNTING
    if gravity is not None:
        return gravity.up, gravity.stddev, gravity.source
    balanced = _up_by_balance(positions)
    if balanced is None:
        return np.array([0.0, -1.0, 0.0]), float(LEVEL_STDDEV), LEVEL_SENSOR
    return *balanced, UPRIGHT_BODY


def _up_by_balance(positions: FloatArray) -> tuple[FloatArray, float] | None:
    """The vertical by which a person on the feet is in balance; None if there is none.

    Returns:
        The vertical, (3,), and its standard deviation [rad].
    """
    body = _balanced(positions[:: 1 + len(positions) // MOST_FRAMES])
    best, best_rank = None, (False, False, 0)
    for first in FIRST_UPS:
        up, standing = _balancing(body, first)
        has_walked, is_usual = standing.has_walked(up), bool(abs(up[1]) > np.cos(MAX_TILT))
        rank = has_walked, is_usual, len(standing.trunk)
        if rank[-1] >= MIN_UPRIGHT_FRAMES and (has_walked or is_usual) and rank > best_rank:
            best, best_rank = up, rank
    if best is None:
        return None
    is_clear = best_rank[0] or best_rank[-1] > MIN_SHARE_STANDING * len(body.trunk)
    return best, float(BODY_STDDEV if is_clear else LEVEL_STDDEV)


def _balancing(body: "_Balanced", up: FloatArray) -> tuple[FloatArray, "_Balanced"]:
    """The vertical by which a person is in balance, near a first guess.

    Args:
        body: The person in n frames.
        up: The first guess, (3,).

    Returns:
        The vertical, (3,), and the frames that are in balance.
    """
    trunk = unit_vectors(body.trunk)
    for _ in range(BALANCE_ITERATIONS):  # mean shift to the direction of most trunks
        upright = _angle(trunk, up) < MAX_INCLINATION
        if upright.any():
            up = unit_vectors(np.median(trunk[upright], axis=0))
    body = rows_of(body, _angle(trunk, up) < MAX_INCLINATION)
    for _ in range(BALANCE_ITERATIONS):
        forward = unit_vectors(np.cross(up, body.to_right))
        directions = unit_vectors(body.centre - body.support(up) - AHEAD_OF_ANKLES_M * forward)
        is_near = _angle(directions, up) < MAX_SWAY
        if is_near.any():
            up = unit_vectors(np.median(directions[is_near], axis=0))
    return up, rows_of(body, is_near)


@dataclass(frozen=True)
class _Balanced:
    """A person on the feet in n frames, seen almost whole [m]."""

    centre: FloatArray  # (n, 3) of mass
    ankles: FloatArray  # (n, 2, 3)
    to_right: FloatArray  # (n, 3) from the left to the right hip
    trunk: FloatArray  # (n, 3) from the hips to the neck

    def support(self, up: FloatArray) -> FloatArray:
        """The point between the ankles that carries the person, (n, 3): one, if the other is up."""
        left_is_up = np.diff(-(self.ankles @ up), axis=1)
        share = np.clip((np.abs(left_is_up) - RAISED_M) / RAISED_M, 0.0, 1.0)
        right = 0.5 + 0.5 * share * np.sign(left_is_up)
        return np.asarray((1.0 - right) * self.ankles[:, 0] + right * self.ankles[:, 1])

    def has_walked(self, up: FloatArray) -> bool:
        """Whether the person has gone some way, by steps on one level."""
        if not len(self.ankles):
            return False
        level = np.eye(3) - np.outer(up, up)
        steps = np.linalg.norm(np.diff(self.ankles, axis=1)[:, 0] @ level, axis=1)
        way = np.ptp(np.percentile(self.ankles.mean(axis=1) @ level, (5, 95), axis=0), axis=0)
        heights = np.percentile((self.ankles @ up).min(axis=1), (25, 75))
        return bool(
            way.max() > WALKED_M
            and np.mean(steps > STEP_M) > MIN_SHARE_IN_STEP
            and np.ptp(heights) < LEVEL_M
        )


def _balanced(positions: FloatArray) -> _Balanced:
    """The frames in which the person is on the feet, and seen almost whole.

    There are none if these are so rare that somebody sits whose tracker errs.
    """
    at = {name: positions[:, index] for name, index in JOINT_INDEX.items()}
    bends = []
    for side in ("left", "right"):
        thigh = at[f"{side}_hip"] - at[f"{side}_knee"]
        shank = at[f"{side}_knee"] - at[f"{side}_foot"]
        trunk = at["neck"] - at[f"{side}_hip"]
        bends += [_angle(thigh, shank), _angle(trunk, thigh)]
    bend = np.max(bends, axis=0)
    on_feet = bend < BENT
    on_feet &= on_feet.sum() > MIN_SHARE_ON_FEET * np.isfinite(bend).sum()
    shares = np.array([MASS_SHARES.get(name.split("_")[-1], 0.0) for name in JOINTS])
    masses = np.where(are_known(positions), shares, 0.0)
    on_feet &= masses.sum(axis=1) > MOST_MASS
    masses, seen = masses[on_feet, :, None], np.nan_to_num(positions[on_feet])
    hips = seen[:, JOINT_PAIRS["hip"]]
    return _Balanced(
        centre=(masses * seen).sum(axis=1) / masses.sum(axis=1),
        ankles=seen[:, JOINT_PAIRS["foot"]],
        to_right=hips[:, 1] - hips[:, 0],
        trunk=seen[:, JOINT_INDEX["neck"]] - hips.mean(axis=1),
    )


def _angle(a: FloatArray, b: FloatArray) -> FloatArray:
    """Angle [rad] between vectors; NaN where one is unknown."""
    lengths = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.arccos(np.clip((a * b).sum(axis=-1) / lengths, -1.0, 1.0))


def _plane(
    standing: FloatArray, up: FloatArray, up_stddev: float, *, have_walked: bool = True
) -> tuple[FloatArray, float, float, float]:
    """The plane of the standing feet, with an initial estimate of its normal as prior.

    Args:
        standing: The lower feet [m] in the reference's frame, (n, 3).
        up: The initial estimate, (3,).
        up_stddev: Its standard deviation [rad].
        have_walked: Whether the feet correct it; feet at rest show hardly any slope.

    Returns:
        Its normal, the feet's height along it relative to the sensor [m], the standard deviations
        of the normal [rad] and of that height [m].
    """
    R_level_reference = _map_frame(up, 0.0)[:3, :3]
    x, y, h = _cells(standing @ R_level_reference.T)
    centre = np.array([x.mean(), y.mean()])
    design = np.column_stack([x - centre[0], y - centre[1], np.ones(len(x))])
    solution, covariance = _robust_fit(design, h)
    # Feet that are not on a plane, on boxes or of a crawling person, tell less.
    scatter = float(robust_stddev(h - design @ solution))
    excess = max(1.0, scatter / PLANE_SCATTER_M) ** 2
    slope_covariance = covariance[:2, :2] + np.tan(FOOT_SLOPE_STDDEV) ** 2 * np.eye(2)
    body_covariance = np.tan(up_stddev) ** 2 * np.eye(2)
    slope = solution[:2]
    distance = slope @ np.linalg.solve(body_covariance + excess * slope_covariance, slope)
    excess *= max(1.0, float(distance) / MAX_DISTANCE)  # stairs are a plane, but no floor
    slope_covariance *= excess
    gain = body_covariance @ np.linalg.inv(body_covariance + slope_covariance)
    gain *= have_walked
    a, b = gain @ solution[:2]
    normal = np.array([-a, -b, 1.0]) / np.sqrt(a * a + b * b + 1.0)
    sole = float(normal @ [*centre, solution[2]])
    stddev = float(np.sqrt(np.linalg.eigvalsh(body_covariance - gain @ body_covariance)[-1]))
    # The sensor is away from the middle of the feet: a wrong vertical changes its height.
    height_variance = covariance[2, 2] + (centre @ centre) * stddev**2
    height_variance += float(np.var(h)) if excess > 1.0 else 0.0
    return R_level_reference.T @ normal, sole, stddev, float(np.sqrt(height_variance))


def _cells(level: FloatArray) -> FloatArray:
    """Middle and height of each cell of the floor in which feet stand, (3, cells) [m].

    Args:
        level: The lower feet [m], z up, (n, 3).
    """
    _, members, counts = np.unique(
        np.floor(level[:, :2] / CELL_M).astype(int), axis=0, return_inverse=True, return_counts=True
    )
    members = members.reshape(-1)
    # Gross errors are scattered over cells where nobody stands.
    rarest = np.argsort(counts, kind="stable")
    cells = np.sort(rarest[np.cumsum(counts[rarest]) > RARE * len(level)])
    # Within a cell the lower feet stand and the higher ones swing.
    return np.array(
        [
            (*level[members == cell, :2].mean(axis=0), np.percentile(level[members == cell, 2], 25))
            for cell in cells
        ]
    ).T


def _robust_fit(design: FloatArray, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slopes and height of a plane through heights (n,) [m], by Huber's weights; covariance."""
    prior = np.diag([np.tan(WEAK_PRIOR) ** -2, np.tan(WEAK_PRIOR) ** -2, 0.0])
    solution = np.array([0.0, 0.0, np.median(h)])
    for _ in range(ITERATIONS):
        off = np.abs(h - design @ solution)
        weights = np.minimum(1.0, HUBER_M / np.maximum(off, 1e-9)) / FOOT_STDDEV_M**2
        covariance = np.linalg.inv(design.T @ (design * weights[:, None]) + prior)
        solution = covariance @ (design.T @ (weights * h))
    return solution, covariance


def _map_frame(up: FloatArray, height: float) -> FloatArray:
    """``T_map_reference`` from the vertical in the reference frame and the height [m]."""
    forward, image_down = np.eye(3)[2], np.eye(3)[1]
    x = forward - (forward @ up) * up
    if np.linalg.norm(x) < LOOKING_SIDEWAYS:
        x = np.sign(forward @ up) * image_down
        x -= (x @ up) * up
    x /= np.linalg.norm(x)
    return rigid_transform([x, np.cross(up, x), up], [0.0, 0.0, height])
