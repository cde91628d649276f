r"""Holds each IMU's angular velocity against the change of its own orientation.

Over a window both measure one turn, in the sensor's frame,

.. math::
    \sum_k \log(q_{k-1}^{-1} \otimes q_k) = \sum_k \tfrac{1}{2}(\omega_{k-1} + \omega_k)\,\Delta t

An angular velocity that contradicts the orientation window after window, or that the device does
not measure (NaN), is replaced by the orientation's rate of change.

An orientation that is the inverse, or whose quaternion is in the order w x y z, changes in its own
world by :math:`-A` times the turn that the angular velocity measures, with a constant rotation A.
By that it is found, and not used. Turns about one axis fit both an inverse orientation and an
angular velocity about other axes; until others tell them apart, the IMU is not used either.
"""

from collections.abc import Mapping
from dataclasses import replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.imu.imu_rows import ImuRows
from pose_core.imu.sensor_alignment import best_fit
from pose_core.kernels.compiling import compiled_in_place, compiled_into_caller, type_specialised
from pose_core.kernels.linear_algebra import is_equal
from pose_core.kernels.quaternions import quaternion_product
from pose_core.kernels.rotations import vector_scale
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock

REPLACED_STDDEV = 0.2  # [rad/s] of a rate that is the orientation's change
SMOOTHING_S = 0.005  # [s] time constant of that change
MAX_STEP_S = 0.1  # [s] after a longer gap nothing is compared
MAX_RATE = 35.0  # [rad/s] a faster change is a leap of the orientation
WINDOW_S = 0.1  # [s]
MIN_TURN = 0.07  # [rad] within a window
TURN_NOISE = 0.03  # [rad] of an orientation within a window, and of a gyroscope's bias
MEMORY = 0.98  # [-] weight of a window against the next
MIN_WINDOWS = 4.5  # [-] weight of the windows before a rate is replaced
CERTAIN_WINDOWS = 9.0  # [-] and before it is named
CONTRADICTION = 0.5  # [-] error's power about an axis, against the turn's
MIN_SHARE = 0.2  # [-] of the turn's power, that an axis counts with at least
MIN_MEASURED = 50  # [-] samples with a rate, of a device that measures it
MISSING_MEMORY = 0.02  # [-] weight of a sample in the share of those without a rate
INVERSE_FITS, ELSE_FITS = 0.9, 0.75  # [-] share of the turns that an inverse explains, and does not
MAX_UNDECIDED = 30.0  # [-] weight of the windows from which on turns about one axis are all it has
MIN_INVERSE = 2  # [-] IMUs found inverse from which on their driver is to blame
NO_TURN, MANY_TURNS = 0.01, 100.0  # [-] power of the rate's turn, against the orientation's


class RateFault(IntEnum):
    """What is wrong with an IMU's angular velocity."""

    NONE = 0
    MISSING = 1
    ZERO = 2
    TOO_LARGE = 3
    OTHER_AXES = 4
    LOST = 5
    INVERSE = 6

    def __str__(self) -> str:
        return _WORDS[self]


_WORDS = {
    RateFault.NONE: "",
    RateFault.MISSING: "is not measured",
    RateFault.LOST: "is not measured any more, or not finite",
    RateFault.ZERO: "stays zero while the orientation turns: make its driver publish it",
    RateFault.TOO_LARGE: "does not match the orientation's change: degrees per second?",
    RateFault.INVERSE: "fits the inverse of the orientation",
    RateFault.OTHER_AXES: (
        "does not match the orientation's change: flipped axis, or another frame than the sensor's?"
    ),
}


class _RateMemory(NamedTuple):
    """What is known of each IMU, from sample to sample; the defaults are the row of a new one."""

    stamp_ns: NDArray[np.int64] = np.zeros(1, np.int64)  # of the last sample; 0: none
    orientation: FloatArray = np.zeros((1, 4))  # of the last sample
    given: FloatArray = np.zeros((1, 3))  # [rad/s] angular velocity of the last sample
    held_s: FloatArray = np.zeros(1)  # [s] for which the orientation has been the same
    change: FloatArray = np.zeros((1, 3))  # [rad/s] of the orientation
    window_s: FloatArray = np.zeros(1)  # [s] of the window so far
    turn: FloatArray = np.zeros((1, 3))  # [rad] in the window, by the orientation
    given_turn: FloatArray = np.zeros((1, 3))  # [rad] in the window, by the angular velocity
    world_turn: FloatArray = np.zeros((1, 3))  # [rad] in the window, in its world
    since: FloatArray = np.zeros((1, 3))  # [rad] by the rate, while the orientation is held
    windows: FloatArray = np.zeros(1)  # weight of the windows with a turn
    error: FloatArray = np.zeros((1, 3))  # weighted sum of the squared difference of the turns
    power: FloatArray = np.zeros((1, 3))  # that of the orientation's turn
    given_power: FloatArray = np.zeros(1)  # that of the angular velocity's turn, all axes
    products: FloatArray = np.zeros((1, 2, 3, 3))  # of the rate's turns with the others
    missing: FloatArray = np.zeros(1)  # share of samples without an angular velocity
    measured: NDArray[np.int64] = np.zeros(1, np.int64)  # number of samples with one
    fault: NDArray[np.int64] = np.zeros(1, np.int64)  # contradiction, see :class:`RateFault`


class AngularVelocityCheck:
    """Replaces angular velocities that are not measured, or that contradict the orientation."""

    def __init__(self) -> None:
        self._rows = ImuRows(_RateMemory())
        self._check_rates = type_specialised(check_rates)
        self._is_any_replaced = False

    @property
    def replaced(self) -> frozenset[str]:
        """Segments whose angular velocity is the orientation's change."""
        if not self._is_any_replaced:
            return frozenset()
        memory = self._rows.memory
        return frozenset(self._rows.named((memory.fault > 0) | (memory.missing > 0.5)))

    @property
    def faults(self) -> Mapping[str, RateFault]:
        """What is certainly wrong with angular velocities that are replaced, by segment."""
        memory = self._rows.memory
        contradicted = np.where(memory.windows < CERTAIN_WINDOWS, RateFault.NONE, memory.fault)
        for imu in np.flatnonzero(contradicted == RateFault.OTHER_AXES).tolist():
            if self._is_inverse(imu):
                contradicted[imu] = RateFault.INVERSE
        had_rates = memory.measured >= MIN_MEASURED
        unmeasured = np.where(had_rates, RateFault.LOST, RateFault.MISSING)
        missing = np.where(memory.missing > 0.5, unmeasured, RateFault.NONE)
        faults = self._rows.named(np.where(contradicted, contradicted, missing))
        return {segment: RateFault(fault) for segment, fault in faults.items()}

    @property
    def inverse(self) -> frozenset[str]:
        """Segments whose orientations are the inverse: all, if those of two are and none is sound.

        Segments that hardly turn cannot be judged, but their IMUs have the same driver.
        """
        memory = self._rows.memory
        found = [name for name, fault in self.faults.items() if fault == RateFault.INVERSE]
        is_sound = (memory.fault == RateFault.NONE) & (memory.windows >= CERTAIN_WINDOWS)
        is_driver = len(found) >= MIN_INVERSE and not is_sound.any()
        return frozenset(self._rows.segments if is_driver else found)

    @property
    def undecided(self) -> frozenset[str]:
        """Segments whose orientations may be the inverse, by the few turns so far."""
        memory = self._rows.memory
        is_new = (memory.fault == RateFault.OTHER_AXES) & (memory.windows < MAX_UNDECIDED)
        rows = np.flatnonzero(is_new).tolist()
        return frozenset(self._rows.segments[i] for i in rows if self._fits(i)[1] > INVERSE_FITS)

    def _is_inverse(self, imu: int) -> bool:
        """Whether an IMU's angular velocity fits the inverse of its orientation, and that only."""
        plain, inverse = self._fits(imu)
        return inverse > INVERSE_FITS and plain < ELSE_FITS

    def _fits(self, imu: int) -> tuple[float, float]:
        """How well an angular velocity fits the orientation in other axes, and its inverse."""
        memory = self._rows.memory
        forward, backward = memory.products[imu]
        scale = np.sqrt(memory.power[imu].sum() * memory.given_power[imu])
        return best_fit(forward) / scale, best_fit(-backward) / scale

    def checked(self, block: ImuBlock) -> ImuBlock:
        """The samples, each with a finite angular velocity that agrees with its orientations."""
        imu, rate = self._rows.of(block), np.array(block.angular_velocity)
        arguments = self._rows.memory, imu, block.stamps_ns, block.orientation, rate
        self._is_any_replaced = self._check_rates(*arguments)
        return replace(block, angular_velocity=rate) if self._is_any_replaced else block


@compiled_in_place
def check_rates(
    memory: _RateMemory,
    imu: NDArray[np.int64],
    stamps_ns: NDArray[np.int64],
    orientation: FloatArray,
    rate: FloatArray,
) -> bool:
    """Check angular velocities one after the other; whether any is replaced, or the next will be.

    Args:
        memory: Is updated.
        imu: Row of each sample's IMU, (n,).
        stamps_ns: (n,).
        orientation: (n, 4), x y z w.
        rate: (n, 3) [rad/s]; replaced where it is not finite, or its IMU's contradict.
    """
    is_any_replaced = False
    for row in range(len(imu)):
        i = imu[row]
        dt_s = (stamps_ns[row] - memory.stamp_ns[i]) / NS_PER_S
        memory.held_s[i] += dt_s
        is_measured = True
        for axis in range(3):
            given = rate[row, axis]
            is_measured &= np.isfinite(given)
            memory.since[i, axis] += 0.5 * dt_s * (memory.given[i, axis] + given)
            memory.given[i, axis] = given
        if dt_s < 0.0 or memory.held_s[i] > MAX_STEP_S:
            _begin_window(memory, i)
            _anchor(memory, i, orientation[row])
            memory.change[i] = 0.0
        elif not is_equal(memory.orientation[i], orientation[row]):
            if memory.held_s[i] > 0.0:
                _add_turn(memory, i, orientation[row])
            _anchor(memory, i, orientation[row])
            if memory.window_s[i] >= WINDOW_S:
                _judge(memory, i)
                _begin_window(memory, i)
        memory.stamp_ns[i] = stamps_ns[row]
        memory.measured[i] += is_measured
        memory.missing[i] += MISSING_MEMORY * ((0.0 if is_measured else 1.0) - memory.missing[i])
        if memory.fault[i] != RateFault.NONE or not is_measured:
            is_any_replaced = True
            for axis in range(3):
                rate[row, axis] = memory.change[i, axis]
    for i in range(len(memory.fault)):
        is_any_replaced |= memory.fault[i] != RateFault.NONE or memory.missing[i] > 0.5
    return is_any_replaced


@compiled_in_place
def _begin_window(memory: _RateMemory, i: int) -> None:
    memory.window_s[i] = 0.0
    memory.turn[i] = 0.0
    memory.given_turn[i] = 0.0
    memory.world_turn[i] = 0.0


@compiled_into_caller
def _anchor(memory: _RateMemory, i: int, orientation: FloatArray) -> None:
    """From here on the orientation's next change counts."""
    memory.held_s[i] = 0.0
    memory.since[i] = 0.0
    for k in range(4):
        memory.orientation[i, k] = orientation[k]


@compiled_into_caller
def _add_turn(memory: _RateMemory, i: int, after: FloatArray) -> None:
    """Add a step's turn to the window; a leap of the orientation begins a new one."""
    before, step_s = memory.orientation[i], memory.held_s[i]
    back = (-before[0], -before[1], -before[2], before[3])
    x, y, z, w = quaternion_product(back, (after[0], after[1], after[2], after[3]))
    length = np.sqrt(x * x + y * y + z * z + w * w)
    scale = vector_scale(x / length, y / length, z / length, w / length) / length
    turn = (scale * x, scale * y, scale * z)
    if turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2 > (MAX_RATE * step_s) ** 2:
        _begin_window(memory, i)
        return
    forth = (before[0], before[1], before[2], before[3])
    turned = quaternion_product(forth, (turn[0], turn[1], turn[2], 0.0))
    world = quaternion_product(turned, back)
    share = step_s / (step_s + SMOOTHING_S)
    memory.window_s[i] += step_s
    for axis in range(3):
        memory.change[i, axis] += share * (turn[axis] / step_s - memory.change[i, axis])
        memory.turn[i, axis] += turn[axis]
        memory.given_turn[i, axis] += memory.since[i, axis]
        memory.world_turn[i, axis] += world[axis]


@compiled_into_caller
def _judge(memory: _RateMemory, i: int) -> None:
    """Add a window to the evidence, relative to its larger turn, and judge all of it."""
    power = given_power = 0.0
    for axis in range(3):
        power += memory.turn[i, axis] ** 2
        given_power += memory.given_turn[i, axis] ** 2
    largest = max(power, given_power)
    if not np.isfinite(given_power) or largest < MIN_TURN**2:
        return
    memory.windows[i] = MEMORY * memory.windows[i] + 1.0
    memory.given_power[i] = MEMORY * memory.given_power[i] + given_power / largest
    forward, backward = memory.products[i]
    for axis in range(3):
        given = memory.given_turn[i, axis] / largest
        for k in range(3):
            forward[axis, k] = MEMORY * forward[axis, k] + given * memory.turn[i, k]
            backward[axis, k] = MEMORY * backward[axis, k] + given * memory.world_turn[i, k]
    worst = all_power = 0.0
    for axis in range(3):
        turn, given = memory.turn[i, axis], memory.given_turn[i, axis]
        error = max((given - turn) ** 2 - TURN_NOISE**2, 0.0)
        memory.error[i, axis] = MEMORY * memory.error[i, axis] + error / largest
        memory.power[i, axis] = MEMORY * memory.power[i, axis] + turn**2 / largest
        least = MIN_SHARE * memory.windows[i]
        worst = max(worst, memory.error[i, axis] / max(memory.power[i, axis], least))
        all_power += memory.power[i, axis]
    if memory.windows[i] < MIN_WINDOWS:
        if given_power > MANY_TURNS * max(power, TURN_NOISE**2):
            memory.fault[i] = RateFault.TOO_LARGE  # it would turn its limb many times until then
        return
    if worst < CONTRADICTION:
        memory.fault[i] = RateFault.NONE
    elif memory.given_power[i] < NO_TURN * all_power:
        memory.fault[i] = RateFault.ZERO
    elif memory.given_power[i] > MANY_TURNS * all_power:
        memory.fault[i] = RateFault.TOO_LARGE
    else:
        memory.fault[i] = RateFault.OTHER_AXES
