r"""The segment filter's prediction: rates that die away, :math:`\dot\omega = -\omega/\tau + w`."""

from typing import NamedTuple

import numpy as np

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.placing import BodyNumbers, Pose, place_joints
from pose_core.kernels.rotations import turn_by
from pose_core.streams.samples import FloatArray


class MotionNumbers(NamedTuple):
    """How a body moves, and for how long it is remembered."""

    power: FloatArray  # (moving, moving) of the white accelerations
    rate_memory_s: float  # [s] in which rates die away
    slide_memory_s: float  # [s] likewise of slides
    slide_variance: float  # [m²] of a slide in the long run
    place_memory_s: float  # [s] for which the joints' places are remembered
    largest_stddev: float  # [rad] beyond which a link's unseen turn grows no further


@compiled
def predict(
    body: BodyNumbers,
    pose: Pose,
    P: FloatArray,
    memory: FloatArray,
    dt_s: float,
    motion: MotionNumbers,
) -> None:
    """Go on in place: the pose, its covariance and what is remembered.

    Args:
        body: The tree.
        pose: The state.
        P: Its covariance.
        memory: See :func:`remember`.
        dt_s: Time step [s].
        motion: How the body moves.
    """
    keep = np.exp(-dt_s / motion.rate_memory_s)
    reach_s = motion.rate_memory_s * (1.0 - keep)
    keep_slide = np.exp(-dt_s / motion.slide_memory_s)
    predict_pose(pose, keep, reach_s, keep_slide)
    predict_covariance(P, dt_s, keep, reach_s, keep_slide, motion.power, motion.slide_variance)
    # Keep what nothing sees where small-angle errors still mean something.
    bound(P, 3, 3 + 3 * len(pose.rotations), motion.largest_stddev)
    remember(body, pose, 1.0 - np.exp(-dt_s / motion.place_memory_s), memory)


@compiled_in_place
def predict_pose(pose: Pose, keep: float, reach_s: float, keep_slide: float) -> None:
    """Go on in place.

    Args:
        pose: The state.
        keep: What remains of the rates [-].
        reach_s: How far one unit of rate leads meanwhile [s].
        keep_slide: What remains of the slides [-].
    """
    for link in range(len(pose.rotations)):
        w = pose.rates[link]
        turn_by(reach_s * w[0], reach_s * w[1], reach_s * w[2], pose.rotations[link])
    for axis in range(3):
        pose.position[axis] += reach_s * pose.velocity[axis]
        pose.velocity[axis] *= keep
        for link in range(len(pose.rates)):
            pose.rates[link, axis] *= keep
        for slide in range(len(pose.slides)):
            pose.slides[slide, axis] *= keep_slide


@compiled_in_place
def predict_covariance(
    P: FloatArray,
    dt_s: float,
    keep: float,
    reach_s: float,
    keep_slide: float,
    power: FloatArray,
    slide_variance: float,
) -> None:
    """F P Fᵀ + Q in place, F = [[1, reach], [0, keep]] over what moves, and ``keep_slide``.

    Args:
        P: The covariance: what moves, slides, then the rates of what moves.
        dt_s: Time step [s].
        keep: See :func:`predict_pose`.
        reach_s: Likewise.
        keep_slide: Likewise.
        power: Of the white accelerations, (moving, moving).
        slide_variance: Of a slide in the long run [m²].
    """
    moving = len(power)
    pose = len(P) - moving  # where rates begin
    own, along, rate = dt_s**3 / 3.0, dt_s**2 / 2.0, dt_s
    # Parts of rows by themselves: from 0 on, a compiler sees that no index is negative.
    for i in range(moving):
        above, beside = P[i, :moving], P[i, pose:]
        behind, both = P[pose + i, :moving], P[pose + i, pose:]
        for k in range(moving):
            m, a, b, r = above[k], beside[k], behind[k], both[k]
            above[k] = m + reach_s * (a + b + reach_s * r) + own * power[i, k]
            beside[k] = keep * (a + reach_s * r) + along * power[i, k]
            behind[k] = keep * (b + reach_s * r) + along * power[i, k]
            both[k] = keep * keep * r + rate * power[i, k]
        slides, rates_slides = P[i, moving:pose], P[pose + i, moving:pose]
        for k in range(len(slides)):
            slides[k] = keep_slide * (slides[k] + reach_s * rates_slides[k])
            rates_slides[k] *= keep * keep_slide
    for i in range(moving, pose):
        above, beside, slides = P[i, :moving], P[i, pose:], P[i, moving:pose]
        for k in range(moving):
            above[k] = keep_slide * (above[k] + reach_s * beside[k])
            beside[k] *= keep * keep_slide
        for k in range(len(slides)):
            slides[k] *= keep_slide * keep_slide
        P[i, i] += slide_variance * (1.0 - keep_slide**2)


@compiled_in_place
def bound(P: FloatArray, first: int, last: int, largest: float) -> None:
    """Scale P so that no standard deviation of the rows in between exceeds the largest [rad]."""
    for i in range(first, last):
        stddev = np.sqrt(P[i, i])
        if stddev > largest:
            scale = largest / stddev
            for k in range(len(P)):
                P[i, k] *= scale
            for k in range(len(P)):
                P[k, i] *= scale


@compiled
def remember(body: BodyNumbers, pose: Pose, share: float, memory: FloatArray) -> None:
    """Let each joint's remembered place, relative to the root, follow the present one."""
    count = len(memory)
    levers = np.zeros((count, len(pose.rotations), 3))
    joints = np.empty((count, 3))
    place_joints(body, pose.position, pose.rotations, pose.slides, levers, joints)
    for j in range(count):
        for axis in range(3):
            relative = joints[j, axis] - pose.position[axis]
            memory[j, axis] += share * (relative - memory[j, axis])


@compiled_in_place
def move(pose: Pose, error: FloatArray) -> None:
    """Add an error to the state, in place: rotations in their group."""
    links, slides = len(pose.rotations), len(pose.slides)
    rates = 3 + 3 * links + 3 * slides
    for axis in range(3):
        pose.position[axis] += error[axis]
        pose.velocity[axis] += error[rates + axis]
        for link in range(links):
            pose.rates[link, axis] += error[rates + 3 + 3 * link + axis]
        for slide in range(slides):
            pose.slides[slide, axis] += error[3 + 3 * links + 3 * slide + axis]
    for link in range(links):
        at = 3 + 3 * link
        turn_by(error[at], error[at + 1], error[at + 2], pose.rotations[link])
