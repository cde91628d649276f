r"""Checks the orientations of each IMU against its gyroscope, before they are used.

Between two samples, the gyroscope predicts the rotation of the sensor:

.. math:: \hat q_k = q_{k-1} \otimes \exp(\tfrac{1}{2}(\omega_{k-1} + \omega_k)\,\Delta t)

The remainder, :math:`q_k \otimes \hat q_k^{-1}`, is a jump of the orientation in its reference
frame. A jump about the vertical is one of the heading, for example if the IMU's north is reset: it
is subtracted from all later samples. Any other large jump that the next samples do not undo is a
slip: the sensor's orientation on the segment has changed, or another sensor uses its name. An IMU
that jumps repeatedly, or repeats its orientation although it rotates, is excluded until it has been
steady for a second. So is one whose gyroscope is saturated, for two seconds: an axis stays at the
largest value that it has had. What its orientation filter integrates then is wrong.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.imu.imu_rows import ImuRows
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller, type_specialised
from pose_core.kernels.linear_algebra import is_equal, norm
from pose_core.kernels.quaternions import integrated_orientation, quaternion_product
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock

MAX_STEP_S = 0.1  # [s] the gyroscope is not integrated over longer gaps
MIN_JUMP = 0.2  # [rad] larger than any orientation filter corrects between two samples
SCALE_ERROR = 0.1  # [-] of a gyroscope
STAMP_ERROR_S = 0.01  # [s] of the time between two samples that are stamped on arrival
STUCK_S = 0.3  # [s] for which a rotating IMU may repeat its rate and orientation
STUCK_TURN = 0.3  # [rad] by which it may rotate while it repeats its orientation
MIN_RATE = 0.2  # [rad/s] more than a gyroscope's bias
MAX_TILT = 0.1  # [rad] tilt that a jump of the heading may have
TOLERATED = 3.0  # [jumps] before an IMU is excluded
FORGIVEN = 2.0  # [jumps/s]
STEADY_NS = NS_PER_S  # [ns] without a jump, after which it is used again
MIN_SLIP = 0.35  # [rad] jump of a sensor that has moved on its segment
MIN_SATURATED = 4.0  # [rad/s] smaller than any gyroscope's range
PLATEAU = 2  # [-] repetitions of an axis' largest value, from which on it is saturated
SATURATED_NS = 2 * NS_PER_S  # [ns] after which an orientation filter has recovered
SLIP_NS = NS_PER_S // 40  # [ns] without a further jump, after which it is no bad sample


class _OrientationMemory(NamedTuple):
    """Memory of each IMU, from sample to sample; the defaults are the row of a new one."""

    stamp_ns: NDArray[np.int64] = np.zeros(1, np.int64)  # of the last sample; 0: none
    orientation: FloatArray = np.zeros((1, 4))  # of the last sample, unchanged
    rate: FloatArray = np.zeros((1, 3))  # [rad/s] of the last sample
    same_s: FloatArray = np.zeros(1)  # [s] for which orientation and rate have been constant
    turned: FloatArray = np.zeros(1)  # [rad] by its gyroscope since the orientation has changed
    jump_ns: NDArray[np.int64] = np.zeros(1, np.int64)  # stamp of the last jump
    jumps: FloatArray = np.zeros(1)  # number of recent jumps, decaying
    is_doubted: NDArray[np.bool_] = np.zeros(1, np.bool_)  # a jump may be a slip, or bad samples
    believed: FloatArray = np.zeros((1, 4))  # orientation without the jump, by the gyroscope
    slips: NDArray[np.int64] = np.zeros(1, np.int64)  # number of slips
    heading: FloatArray = np.zeros(1)  # [rad] correction of orientations about the vertical
    excluded: NDArray[np.bool_] = np.zeros(1, np.bool_)
    largest: FloatArray = np.full((1, 3), MIN_SATURATED)  # [rad/s] magnitude by axis
    repeated: NDArray[np.int64] = np.zeros((1, 3), np.int64)  # how often it has just been repeated
    saturated_ns: NDArray[np.int64] = np.zeros(1, np.int64)  # stamp of the last saturated rate
    saturated: NDArray[np.int64] = np.zeros(1, np.int64)  # number of samples rejected for that


class OrientationCheck:
    """Passes the samples whose orientation agrees with their IMU's gyroscope."""

    def __init__(self) -> None:
        self._rows = ImuRows(_OrientationMemory())
        self._check_samples = type_specialised(check_samples)

    @property
    def excluded(self) -> tuple[str, ...]:
        """Segments whose IMU is excluded."""
        return tuple(self._rows.named(self._rows.memory.excluded))

    @property
    def jumping(self) -> tuple[str, ...]:
        """Segments whose IMU has jumped within the last second, including excluded ones."""
        memory = self._rows.memory
        recent = memory.stamp_ns - memory.jump_ns <= STEADY_NS
        return tuple(self._rows.named((memory.jump_ns > 0) & recent))

    @property
    def saturated(self) -> tuple[str, ...]:
        """Segments whose IMU is not used because its gyroscope was saturated."""
        memory = self._rows.memory
        recent = memory.stamp_ns - memory.saturated_ns < SATURATED_NS
        return tuple(self._rows.named((memory.saturated_ns > 0) & recent))

    @property
    def saturated_samples(self) -> int:
        """Number of samples rejected for that so far."""
        return int(self._rows.memory.saturated.sum())

    @property
    def headings(self) -> Mapping[str, float]:
        """Corrections about the vertical [rad] of IMUs whose heading has jumped."""
        return self._rows.named(self._rows.memory.heading)

    @property
    def slips(self) -> Mapping[str, int]:
        """How often each IMU has slipped, of those that have."""
        return self._rows.named(self._rows.memory.slips)

    def checked(self, block: ImuBlock) -> ImuBlock:
        """The accepted samples, with jumps of the heading removed."""
        imu = self._rows.of(block)
        orientation = np.array(block.orientation)
        is_used = np.empty(len(block), np.bool_)
        are_as_given = self._check_samples(
            self._rows.memory, imu, block.stamps_ns, orientation, block.angular_velocity, is_used
        )
        if are_as_given:
            return block
        return replace(block, orientation=orientation).rows(np.flatnonzero(is_used))


@compiled_in_place
def check_samples(
    memory: _OrientationMemory,
    imu: NDArray[np.int64],
    stamps_ns: NDArray[np.int64],
    orientation: FloatArray,
    rate: FloatArray,
    is_used: NDArray[np.bool_],
) -> bool:
    """Check samples one after the other; whether all are accepted, and none is turned.

    Args:
        memory: Memory of the IMUs; updated.
        imu: Index of each sample's IMU, (n,).
        stamps_ns: (n,).
        orientation: (n, 4), x y z w; turned by the heading.
        rate: (n, 3) [rad/s].
        is_used: Filled, (n,).
    """
    are_as_given = True
    for row in range(len(imu)):
        i = imu[row]
        dt_s = (stamps_ns[row] - memory.stamp_ns[i]) / NS_PER_S
        has_jumped = may_have_slipped = False
        if is_saturated(rate[row], memory.rate[i], memory.largest[i], memory.repeated[i]):
            memory.saturated_ns[i] = stamps_ns[row]
        saturated = memory.saturated_ns[i] > 0
        saturated &= stamps_ns[row] - memory.saturated_ns[i] < SATURATED_NS
        if 0.0 < dt_s <= MAX_STEP_S and not saturated:
            apart, tilt, turn = orientation_jump(
                memory.orientation[i], memory.rate[i], orientation[row], rate[row], dt_s
            )
            if apart > 0.0 and tilt < MAX_TILT and not memory.excluded[i]:
                memory.heading[i] -= turn
            is_stuck = repeats_orientation(memory, i, orientation[row], rate[row], dt_s)
            has_jumped = apart > 0.0 or is_stuck
            memory.jumps[i] = max(memory.jumps[i] - FORGIVEN * dt_s, 0.0)
            believed = memory.orientation[i]
            if memory.is_doubted[i]:
                believed = memory.believed[i]
                apart, tilt, _ = orientation_jump(
                    believed, memory.rate[i], orientation[row], rate[row], dt_s
                )
            may_have_slipped = apart > MIN_SLIP and tilt >= MAX_TILT
            expected = integrated_orientation(believed, memory.rate[i], rate[row], dt_s)
            for k in range(4):
                memory.believed[i, k] = expected[k]
        if has_jumped:
            memory.jumps[i] = min(memory.jumps[i] + 1.0, TOLERATED + 1.0)
            memory.jump_ns[i] = stamps_ns[row]
            memory.excluded[i] |= memory.jumps[i] > TOLERATED
        elif memory.excluded[i] and stamps_ns[row] - memory.jump_ns[i] > STEADY_NS:
            memory.excluded[i], memory.jumps[i] = False, 0.0
        if may_have_slipped and stamps_ns[row] - memory.jump_ns[i] > SLIP_NS:
            may_have_slipped = False
            memory.slips[i] += 1
        memory.is_doubted[i] = may_have_slipped and not memory.excluded[i]
        is_used[row] = not (has_jumped or memory.is_doubted[i] or memory.excluded[i] or saturated)
        memory.saturated[i] += saturated
        memory.stamp_ns[i] = stamps_ns[row]
        for k in range(4):
            memory.orientation[i, k] = orientation[row, k]
        for axis in range(3):
            memory.rate[i, axis] = rate[row, axis]
        if memory.heading[i] != 0.0:
            turn_about_vertical(orientation[row], memory.heading[i])
        are_as_given &= is_used[row] and memory.heading[i] == 0.0
    return are_as_given


@compiled_into_caller
def turn_about_vertical(orientation: FloatArray, angle: float) -> None:
    """Rotate an orientation, (4,) x y z w, in place about the world's z axis by an angle [rad]."""
    s, c = np.sin(0.5 * angle), np.cos(0.5 * angle)
    x, y, z, w = orientation
    orientation[0], orientation[1] = c * x - s * y, c * y + s * x
    orientation[2], orientation[3] = c * z + s * w, c * w - s * z


@compiled_into_caller
def repeats_orientation(
    memory: _OrientationMemory, i: int, orientation: FloatArray, rate: FloatArray, dt_s: float
) -> bool:
    """Whether an IMU rotates by its gyroscope, but sends the same orientation again and again.

    Args:
        memory: Memory of the IMUs; updated.
        i: The IMU.
        orientation: Of this sample, (4,).
        rate: Of this sample, (3,) [rad/s].
        dt_s: Time since the last sample [s].
    """
    speed = norm(rate)
    is_same = is_equal(memory.orientation[i], orientation)
    same_rate = speed > 0.0 and is_equal(memory.rate[i], rate)
    memory.same_s[i] = memory.same_s[i] + dt_s if is_same and same_rate else 0.0
    turn = speed * dt_s if speed > MIN_RATE else 0.0
    memory.turned[i] = memory.turned[i] + turn if is_same else 0.0
    return memory.same_s[i] > STUCK_S or memory.turned[i] > STUCK_TURN


@compiled_into_caller
def is_saturated(
    rate: FloatArray, before: FloatArray, largest: FloatArray, repeated: NDArray[np.int64]
) -> bool:
    """Whether an axis of the gyroscope stays at the largest value that it has had.

    Args:
        rate: Of this sample, (3,) [rad/s].
        before: Of the last one, (3,) [rad/s].
        largest: Largest magnitude about each axis, (3,) [rad/s]; updated.
        repeated: How often it has just been repeated, (3,); updated.
    """
    found = False
    for axis in range(3):
        magnitude = abs(rate[axis])
        is_same = magnitude >= largest[axis] and rate[axis] == before[axis]
        repeated[axis] = repeated[axis] + 1 if is_same else 0
        largest[axis] = max(largest[axis], magnitude)
        found |= repeated[axis] >= PLATEAU
    return found


@compiled_into_caller
def orientation_jump(
    before: FloatArray, rate_before: FloatArray, after: FloatArray, rate: FloatArray, dt_s: float
) -> tuple[float, float, float]:
    """Jump of an orientation relative to the gyroscope's prediction.

    Args:
        before: Orientation of the last sample, (4,) x y z w.
        rate_before: Its rate, (3,) [rad/s].
        after: Orientation of this one, (4,).
        rate: Its rate, (3,) [rad/s].
        dt_s: The time between them [s].

    Returns:
        Angle of the jump [rad], 0 within the sensor's errors; its tilt [rad] and its rotation about
        the vertical [rad].
    """
    expected = integrated_orientation(before, rate_before, rate, dt_s)
    back = (-expected[0], -expected[1], -expected[2], expected[3])
    a, b, c, d = quaternion_product((after[0], after[1], after[2], after[3]), back)
    if d < 0.0:
        a, b, c, d = -a, -b, -c, -d
    across = np.sqrt(a * a + b * b)
    apart = 2.0 * np.arctan2(np.sqrt(a * a + b * b + c * c), d)
    x, y, z = rate_before[0], rate_before[1], rate_before[2]
    change = 0.5 * dt_s * norm((rate[0] - x, rate[1] - y, rate[2] - z))
    turned = 0.5 * dt_s * norm((rate[0] + x, rate[1] + y, rate[2] + z))
    turn_error = (SCALE_ERROR + STAMP_ERROR_S / dt_s) * turned
    if apart <= MIN_JUMP + turn_error + change:
        return 0.0, 0.0, 0.0
    return apart, 2.0 * np.arctan2(across, np.sqrt(c * c + d * d)), 2.0 * np.arctan2(c, d)
