r"""Output blending: the published pose follows the filter's without a step.

A measurement update, a source that appears or disappears, or a restart makes the filter's pose
jump. The published pose keeps its value and its rate, and the difference e to the filter's pose
decays with critical damping,

.. math:: \ddot e + 2 k \dot e + k^2 e = 0, \quad q = q^* + e, \quad \dot q = \dot q^* + \dot e  (1)

so that the published rate is the derivative of the published angle. 1/k is short where the filter
is certain of an angle and long where it is not, as for the axial rotation of a straight limb. The
joints are blended in the same way, relative to the root. The root's position is blended for longer
the further ahead it is predicted, since an error of its velocity grows with that time. A large
difference is reduced at a bounded rate. At the start and after a silence 1/k is longer, and an
angle's rate is lower: sensors return one after the other, and IMUs are not aligned yet. Root and
joints are not blended where the cameras see a person again who has moved meanwhile: that would be a
motion which nobody made. Angles stay within the limits of the body model.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS
from pose_core.kernels.compiling import compiled_in_place
from pose_core.kernels.forward_kinematics import ModelArrays
from pose_core.kernels.published_state import CAMERAS, DofEstimate

BLEND_S = 0.005  # [s] 1/k of a certain angle, and of the joints' positions
BLEND_OF_PREDICTION = 0.15  # [-] least 1/k of the root's position, as a share of the time predicted
MIN_BLEND_AFTER_GAP_S = 0.03  # [s] least 1/k at the start and after a silence
MAX_BLEND_S = 0.12  # [s] 1/k of an uncertain angle
CERTAIN_STDDEV = np.radians(10.0)  # [rad] up to which an angle counts as certain
MAX_TRAVEL = 8.0  # [rad/s], [m/s] largest rate at which a difference is reduced
TRAVEL_AFTER_GAP = 2.5  # [rad/s] the same of an angle, at the start and after a silence
MAX_RATE = 40.0  # [rad/s] bound of the filter's rate
UNKNOWN_BEYOND = np.radians(15.0)  # [rad] outside its limits, from which on an angle is unknown
UNKNOWN_APART = np.radians(45.0)  # [rad] between published and filter's angle, likewise
UNKNOWN_GROWTH = np.radians(30.0)  # [rad/s] of an unknown angle's standard deviation
MAX_UNKNOWN = np.radians(90.0)  # [rad] up to which it grows
REST_AFTER_S = 0.5  # [s] after a longer silence the output continues from rest
AFTER_GAP_S = 0.01  # [s] taken as elapsed in that case
SLOW_S = 2.0  # [s] at the start and after a silence, angles' differences are reduced slowly
MOVED_M = 0.3  # [m] by which a person has moved who is seen again elsewhere
RETURNING_S = 0.2  # [s] after the first frame of them, while the filter moves there
UNSEEN_SPEED = 0.7  # [m/s] of an unseen person along each horizontal axis (standard deviation)
CARRIED_SPEED = 0.2  # [m/s] error of the same while the IMUs of both legs carry the root
JUMP_M = 0.15  # [m] along each axis in addition: a jump carries the root, and no foot tells
JUMP_S = 0.5  # [s] within which it may


class Blending(NamedTuple):
    """The last output, over d degrees of freedom; updated in place."""

    stamp_ns: NDArray[np.int64]  # (1,) [ns]; 0: nothing
    position: FloatArray  # (d,) [m], [rad]
    velocity: FloatArray  # (d,) [m/s], [rad/s]
    unknown_s: FloatArray  # (d,) [s] for which each has been unknown
    R_map_root: FloatArray  # (3, 3)
    joints: FloatArray  # (joints, 3) [m] relative to the root
    joint_velocity: FloatArray  # (joints, 3) [m/s] likewise
    slow_s: FloatArray  # (1,) [s] for which differences are still reduced slowly
    unseen_s: FloatArray  # (1,) [s] for which no camera has seen the person
    returning_s: FloatArray  # (1,) [s] for which a person counts as just seen again


def make_blending(size: int) -> Blending:
    """State of the blending before the first output."""
    return Blending(
        np.zeros(1, np.int64),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.eye(3),
        np.zeros((len(JOINTS), 3)),
        np.zeros((len(JOINTS), 3)),
        np.full(1, SLOW_S),
        np.zeros(1),
        np.zeros(1),
    )


@compiled_in_place
def advance_clock(blending: Blending, stamp_ns: int) -> float:
    """Time since the last output [s]; 0 if this is the first. After a silence it is at rest."""
    dt_s = (stamp_ns - blending.stamp_ns[0]) * 1e-9
    if blending.stamp_ns[0] == 0 or dt_s <= 0.0:
        return 0.0
    if dt_s <= REST_AFTER_S:
        blending.slow_s[0] = max(blending.slow_s[0] - dt_s, 0.0)
        return dt_s
    blending.slow_s[0] = SLOW_S
    blending.unseen_s[0] = dt_s
    blending.velocity[:] = 0.0
    blending.joint_velocity[:] = 0.0
    return AFTER_GAP_S


@compiled_in_place
def advance_skeleton_clock(blending: Blending, dof: DofEstimate, dt_s: float) -> float:
    """Time [s] since the last output of root and joints; 0 if they are placed anew.

    They are where the cameras see the person again, far from the last output. The filter may need
    several frames until it is there.

    Args:
        blending: The last output; the times since and after the person was unseen are updated.
        dof: The filter's estimate.
        dt_s: See :func:`advance_clock`.
    """
    if dof.information[CAMERAS, 0] <= 0.0:
        blending.unseen_s[0] += dt_s
        return dt_s
    if blending.unseen_s[0] > REST_AFTER_S:
        blending.returning_s[0] = RETURNING_S
    blending.unseen_s[0] = 0.0
    if blending.returning_s[0] <= 0.0:
        return dt_s
    blending.returning_s[0] -= dt_s
    squared = 0.0
    for axis in range(3):
        squared += (dof.position[axis] - blending.position[axis]) ** 2
    return 0.0 if squared > MOVED_M**2 else dt_s


@compiled_in_place
def decay(
    e: float, rate: float, blend_s: float, dt_s: float, travel: float = MAX_TRAVEL
) -> tuple[float, float]:
    """A difference and its rate after some time, by (1).

    With k = 2 v / |e|, (1) has a solution with constant rate v: a large difference that starts at
    rest is reduced at the largest rate.
    """
    k = min(1.0 / blend_s, 2.0 * travel / max(abs(e), 1e-9))
    drive = rate + k * e
    keep = np.exp(-k * dt_s)
    return (e + drive * dt_s) * keep, (rate - k * drive * dt_s) * keep


@compiled_in_place
def blend_angle(
    blending: Blending, at: int, dt_s: float, dof: DofEstimate, limits: FloatArray
) -> bool:
    """Blend one joint angle; return whether it is known.

    Args:
        blending: The angle and its rate are updated.
        at: Index of the degree of freedom.
        dt_s: See :func:`advance_clock`.
        dof: The filter's estimate; what blending adds to the variance is filled in.
        limits: Lower and upper limit, (2,) [rad].
    """
    before, rate_before = blending.position[at], blending.velocity[at]
    goal = min(max(dof.position[at], limits[0]), limits[1])
    rate = min(max(dof.velocity[at], -MAX_RATE), MAX_RATE)
    excess = abs(dof.position[at] - goal)
    is_known = excess <= UNKNOWN_BEYOND
    if not is_known and dt_s > 0.0:
        goal = before
    if (excess > 0.0 and rate * (dof.position[at] - goal) > 0.0) or not is_known:
        rate = 0.0
    e = e_rate = 0.0
    if dt_s > 0.0:
        unsure = dof.variance[at] / CERTAIN_STDDEV**2
        blend_s, travel = min(BLEND_S * max(unsure, 1.0), MAX_BLEND_S), MAX_TRAVEL
        if blending.slow_s[0] > 0.0:
            blend_s, travel = max(blend_s, MIN_BLEND_AFTER_GAP_S), TRAVEL_AFTER_GAP
        e, e_rate = before - (goal - rate * dt_s), rate_before - rate
        e, e_rate = decay(e, e_rate, blend_s, dt_s, travel)
    value = min(max(goal + e, limits[0]), limits[1])
    is_stopped = value != goal + e
    blending.position[at] = value
    blending.velocity[at] = (value - before) / dt_s if is_stopped else rate + e_rate
    is_known = is_known and abs(e) <= UNKNOWN_APART
    blending.unknown_s[at] = 0.0 if is_known else blending.unknown_s[at] + dt_s
    grown = min(excess + UNKNOWN_GROWTH * blending.unknown_s[at], MAX_UNKNOWN)
    dof.blended[at] = grown**2 + e**2
    return is_known


@compiled_in_place
def mark_sweeping_joints_unknown(
    model: ModelArrays,
    limits: FloatArray,
    blending: Blending,
    dof: DofEstimate,
    is_known: NDArray[np.bool_],
) -> None:
    """While an angle of a joint sweeps to another value, none of the joint's angles is known.

    Together they are another rotation than the filter's.

    Args:
        model: The body.
        limits: Lower and upper limits, (d, 2) [rad].
        blending: The last output.
        dof: The filter's estimate; what blending adds to the variances is updated.
        is_known: Updated, (d,).
    """
    for link in range(1, len(model.parents)):
        apart = 0.0
        for at in model.dof[link, : model.dof_count[link]]:
            goal = min(max(dof.position[at], limits[at, 0]), limits[at, 1])
            if abs(dof.position[at] - goal) <= UNKNOWN_BEYOND:
                apart = max(apart, abs(blending.position[at] - goal))
        if apart <= UNKNOWN_APART:
            continue
        for at in model.dof[link, : model.dof_count[link]]:
            is_known[at] = False
            dof.blended[at] = max(dof.blended[at], apart**2)
