"""Angles of one link in its parent: flexion of a hinge, twist, and what links' sensors add."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.kernels.compiling import compiled, compiled_in_place
from pose_core.kernels.placing import Pose
from pose_core.kernels.rotations import logarithm, product_transposed, transposed_product
from pose_core.streams.samples import FloatArray


@compiled_in_place
def flexion(R_parent_link: FloatArray, sign: float) -> float:
    """A hinge's angle [rad], negative when it is bent the wrong way."""
    R = R_parent_link
    return sign * np.arctan2(R[0, 2] - R[2, 0], R[0, 0] + R[2, 2])


@compiled_in_place
def twist(R_parent_link: FloatArray) -> tuple[float, float]:
    """A link's turn about its own z axis, by swing and twist.

    Args:
        R_parent_link: Shape (3, 3).

    Returns:
        The twist [rad], and how well it is defined, from 0 (swung by half a turn) to 1.
    """
    R = R_parent_link
    w = 0.5 * np.sqrt(max(0.0, 1.0 + R[0, 0] + R[1, 1] + R[2, 2]))
    z = (R[1, 0] - R[0, 1]) / (4.0 * w) if w > 1e-6 else 1.0
    return 2.0 * np.arctan2(z, w), min(1.0, w * w + z * z)


@compiled
def turn_back(
    rotations: FloatArray,
    parents: NDArray[np.int64],
    links: NDArray[np.int64],
    signs: FloatArray,
    wrong_bend: float,
) -> int:
    """Undo half turns of limbs about themselves, in place; returns how many.

    Args:
        rotations: ``R_map_link``, (links, 3, 3).
        parents: Of each hinge.
        links: Of each hinge.
        signs: Of each hinge.
        wrong_bend: Angle [rad], negative, beyond which a limb is taken as turned.
    """
    relative = np.empty((3, 3))
    count = 0
    for hinge in range(len(links)):
        upper, lower = rotations[parents[hinge]], rotations[links[hinge]]
        transposed_product(upper, lower, relative)
        if flexion(relative, signs[hinge]) < wrong_bend:
            upper[:, :2] *= -1.0
            lower[:, :2] *= -1.0
            count += 1
    return count


class LinkLooks(NamedTuple):
    """What IMUs say of their links at one instant, a row each."""

    links: NDArray[np.int64]  # (n,) which
    R_map_link: FloatArray  # (n, 3, 3)
    variance: FloatArray  # (n, 3) [rad²] about map's axes
    angular_velocity: FloatArray  # (n, 3) [rad/s] in map
    rate_variance: FloatArray  # (n,) [rad²/s²]


class ImuTrust(NamedTuple):
    """What IMUs' readings are worth."""

    mounting: float  # [rad] standard deviation of how they sit
    frames: float  # [-] their errors are slow: so many samples count as one
    gyro: float  # [rad/s] standard deviation of their rates
    held_jerk: float  # [rad/s³] of a limb that swings, while its reading is only carried on


@compiled_in_place
def trust_readings(
    stddev: FloatArray,
    age_s: FloatArray,
    trust: ImuTrust,
    variance: FloatArray,
    rate_variance: FloatArray,
) -> None:
    """What n readings are worth; see :class:`LinkLooks`.

    Args:
        stddev: Their own, (n, 3) [rad] about map's axes.
        age_s: For which each is only carried on, (n,) [s].
        trust: What they are worth.
        variance: Filled, (n, 3) [rad²].
        rate_variance: Filled, (n,) [rad²/s²].
    """
    for row in range(len(age_s)):
        age = age_s[row]
        # What swings has gone elsewhere while its reading was only carried on.
        held = trust.held_jerk * age * age * age / 3.0
        for axis in range(3):
            own = stddev[row, axis] ** 2 + trust.mounting**2
            variance[row, axis] = own * trust.frames + held * held
        rate_variance[row] = trust.gyro**2 + (trust.held_jerk * age * age) ** 2


@compiled
def add_imus(pose: Pose, imus: LinkLooks, information: FloatArray, vector: FloatArray) -> None:
    """Add what IMUs say of their links' rotations and angular velocities.

    Args:
        pose: What the filter expects.
        imus: What they say.
        information: Is added to.
        vector: Is added to.
    """
    relative, turn = np.empty((3, 3)), np.empty(3)
    rates = 3 + 3 * len(pose.rotations) + 3 * len(pose.slides)
    for row in range(len(imus.links)):
        link = imus.links[row]
        product_transposed(imus.R_map_link[row], pose.rotations[link], relative)
        logarithm(relative, turn)
        rate_variance = imus.rate_variance[row]
        for axis in range(3):
            where, rate = 3 + 3 * link + axis, rates + 3 + 3 * link + axis
            variance = imus.variance[row, axis]
            information[where, where] += 1.0 / variance
            vector[where] += turn[axis] / variance
            information[rate, rate] += 1.0 / rate_variance
            faster = imus.angular_velocity[row, axis] - pose.rates[link, axis]
            vector[rate] += faster / rate_variance


@compiled_in_place
def own_blocks(information: FloatArray, out: FloatArray) -> None:
    """The links' own blocks, (links, 3, 3), of the error's information."""
    for link in range(len(out)):
        for i in range(3):
            for k in range(3):
                out[link, i, k] = information[3 + 3 * link + i, 3 + 3 * link + k]
