"""Kernels that read numbers from serialised messages (CDR) and write numbers into them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.kernels.compiling import compiled, compiled_in_place, compiled_into_caller
from pose_core.stamps import NS_PER_S

HEADER_SIZE = 4  # [bytes] of CDR's encapsulation; the second gives the byte order
STAMP_SIZE = 8  # [bytes] seconds and nanoseconds, of four each
LENGTH_SIZE = 4  # [bytes] before a string
NUMBER_SIZE = 8  # [bytes] of a float, at a multiple of that
IMU_NUMBERS = 37  # orientation, rate, acceleration, and their covariances
IMU_VARIANCE = np.array([4, 8, 12])  # the diagonal of the orientation's covariance
IMU_RATE = 13
IMU_RATE_COVARIANCE = 16
IMU_ACCELERATION = 25
IMU_ACCELERATION_COVARIANCE = 28
STRONGEST = 4000.0  # [m/s²] no accelerometer measures as much, per axis
FASTEST_RATE = 200.0  # [rad/s] no gyroscope measures as much, per axis
MAX_RANGE = 100.0  # [m] beyond the range of any sensor: not a position
SHORTEST, LONGEST = 0.9, 1.1  # [-] accepted norm of a quaternion


@compiled
def integer(data: NDArray[np.uint8], at: int, is_little: bool) -> int:
    """The unsigned integer of four bytes at an offset."""
    value = 0
    for k in range(4):
        value = value * 256 + data[at + 3 - k if is_little else at + k]
    return value


@compiled
def stamp_at(data: NDArray[np.uint8], at: int, is_little: bool) -> int:
    """The stamp [ns] at an offset."""
    seconds = integer(data, at, is_little)
    return seconds * NS_PER_S + integer(data, at + STAMP_SIZE // 2, is_little)


@compiled_into_caller
def copy_numbers(data: NDArray[np.uint8], at: int, is_little: bool, out: NDArray[np.uint8]) -> None:
    """Copy the bytes of 8-byte numbers into little-endian order."""
    for k in range(len(out)):
        out[k] = data[at + k] if is_little else data[at + (k ^ (NUMBER_SIZE - 1))]


@compiled
def read_imus(
    data: NDArray[np.uint8],
    ends: NDArray[np.int64],
    stamps_ns: NDArray[np.int64],
    orientation: FloatArray,
    orientation_stddev: FloatArray,
    angular_velocity: FloatArray,
    linear_acceleration: FloatArray,
    says_something: NDArray[np.bool_],
) -> None:
    """Read n messages of ``sensor_msgs/Imu``.

    Args:
        data: The bytes of all messages, one after the other.
        ends: End offset of each message, (n,).
        stamps_ns: Filled, (n,) [ns].
        orientation: Filled, (n, 4).
        orientation_stddev: Filled, (n, 3) [rad].
        angular_velocity: Filled, (n, 3) [rad/s]; NaN where the message has none.
        linear_acceleration: Filled, (n, 3) [m/s²]; NaN where the message has none.
        says_something: Filled, (n,): whether the message has an orientation and valid numbers.
    """
    raw = np.empty(NUMBER_SIZE * IMU_NUMBERS, np.uint8)
    values = raw.view(np.float64)
    start = 0
    for row in range(len(ends)):
        size, first, start = ends[row] - start, start, ends[row]
        says_something[row] = False
        at = HEADER_SIZE + STAMP_SIZE
        if size < at + LENGTH_SIZE:
            continue
        is_little = data[first + 1] % 2 == 1
        at += LENGTH_SIZE + integer(data, first + at, is_little)
        at += -(at - HEADER_SIZE) % NUMBER_SIZE
        if at + NUMBER_SIZE * IMU_NUMBERS > size:
            continue
        stamps_ns[row] = stamp_at(data, first + HEADER_SIZE, is_little)
        copy_numbers(data, first + at, is_little, raw)
        squared, is_known = 0.0, True
        for k in range(4):
            orientation[row, k] = values[k]
            squared += values[k] ** 2
        for k in range(3):
            variance = values[IMU_VARIANCE[k]]
            orientation_stddev[row, k] = np.sqrt(max(variance, 0.0))
            is_known &= np.isfinite(variance)
        read_angular_velocity(values, angular_velocity[row])
        read_acceleration(values, linear_acceleration[row])
        # REP 145: a first element of −1 means that there is no orientation.
        has_orientation = values[IMU_VARIANCE[0]] != -1.0
        is_quaternion = SHORTEST**2 < squared < LONGEST**2
        says_something[row] = has_orientation and is_quaternion and is_known


@compiled_into_caller
def read_angular_velocity(values: FloatArray, out: FloatArray) -> None:
    """Read a message's angular velocity [rad/s]; NaN if it has none, or an impossible one."""
    is_known = values[IMU_RATE_COVARIANCE] != -1.0  # REP 145
    for k in range(3):
        out[k] = values[IMU_RATE + k]
        is_known &= abs(out[k]) < FASTEST_RATE  # false of NaN
    if not is_known:
        out[:] = np.nan


@compiled_into_caller
def read_acceleration(values: FloatArray, out: FloatArray) -> None:
    """Read a message's acceleration [m/s²]; NaN if it has none, or an impossible one."""
    # REP 145 has −1 for none; drivers without one send zeros, which only free fall measures.
    is_known, is_any = values[IMU_ACCELERATION_COVARIANCE] != -1.0, False
    for k in range(3):
        out[k] = values[IMU_ACCELERATION + k]
        is_known &= abs(out[k]) < STRONGEST  # false of NaN
        is_any |= out[k] != 0.0
    if not is_known or not is_any:
        out[:] = np.nan


@compiled
def clean_joints(
    xyz: FloatArray,
    states: NDArray[np.uint8],
    named: NDArray[np.int64],
    joints: NDArray[np.int64],
    positions: FloatArray,
    tracking_state: NDArray[np.uint8],
) -> None:
    """Map a sensor's joints to the 15 joints; invalid positions become NaN and NOT_TRACKED.

    Args:
        xyz: Positions, (n, k, 3) [m].
        states: Values of ``TrackingState``, (n, k).
        named: Indices of the sensor's joints that are mapped, (m,).
        joints: Index of each among the 15 joints, (m,).
        positions: Filled, (n, joints, 3) [m].
        tracking_state: Filled, (n, joints).
    """
    positions[:] = np.nan
    tracking_state[:] = 0
    for row in range(len(xyz)):
        for k in range(len(named)):
            x, y, z = xyz[row, named[k]]
            is_place = abs(x) < MAX_RANGE and abs(y) < MAX_RANGE and abs(z) < MAX_RANGE
            # Trackers send (0, 0, 0) for joints that they have lost.
            if not is_place or (x == 0.0 and y == 0.0 and z == 0.0):  # nor a NaN
                continue
            if states[row, named[k]] == 0:
                continue
            joint = joints[k]
            positions[row, joint, 0], positions[row, joint, 1] = x, y
            positions[row, joint, 2] = z
            tracking_state[row, joint] = states[row, named[k]]


class PersonPlaces(NamedTuple):
    """Offsets [bytes] of one person's numbers in a ``SkeletonArray``, and their joints."""

    stamp: int
    positions: int
    states: int
    length: int  # number of joints that the message names
    named: NDArray[np.int64]  # (m,) indices of those that are mapped
    joints: NDArray[np.int64]  # (m,) index of each among the 15 joints


@compiled_in_place
def have_form(
    rows: NDArray[np.uint8],
    fixed: NDArray[np.int64],
    texts: NDArray[np.uint8],
    fits: NDArray[np.bool_],
) -> int:
    """Find the messages that have given bytes at given offsets; returns their number.

    Args:
        rows: The messages, (n, bytes).
        fixed: The offsets, (k,).
        texts: The bytes, (k,).
        fits: Filled, (n,).
    """
    count = 0
    for row in range(len(rows)):
        fits[row] = True
        for k in range(len(fixed)):
            if rows[row, fixed[k]] != texts[k]:
                fits[row] = False
                break
        count += fits[row]
    return count


@compiled
def read_person(
    rows: NDArray[np.uint8],
    places: PersonPlaces,
    is_little: bool,
    stamps_ns: NDArray[np.int64],
    positions: FloatArray,
    tracking_state: NDArray[np.uint8],
    highest: NDArray[np.uint8],
) -> None:
    """Read one person's joints; invalid positions become NaN and NOT_TRACKED.

    Args:
        rows: n messages of one form, (n, bytes).
        places: Offsets of the numbers.
        is_little: Whether the numbers are little-endian.
        stamps_ns: Filled, (n,) [ns].
        positions: Filled, (n, joints, 3) [m].
        tracking_state: Filled, (n, joints), values of ``TrackingState``.
        highest: Filled, (n,): the highest of all states in the message.
    """
    count, size = places.length, 3 * NUMBER_SIZE * places.length
    xyz, states = np.empty((len(rows), count, 3)), np.empty((len(rows), count), np.uint8)
    raw = xyz.reshape(-1).view(np.uint8)
    for row in range(len(rows)):
        data = rows[row]
        stamps_ns[row] = stamp_at(data, places.stamp, is_little)
        copy_numbers(data, places.positions, is_little, raw[row * size : (row + 1) * size])
        highest[row] = 0
        for k in range(count):
            states[row, k] = data[places.states + k]
            highest[row] = max(highest[row], states[row, k])
    clean_joints(xyz, states, places.named, places.joints, positions, tracking_state)


class NumberPlaces(NamedTuple):
    """Offsets of a message's numbers, each aligned to its size, in units of that size."""

    stamps: NDArray[np.int64]  # of stamps, in units of four bytes
    float64: NDArray[np.int64]  # (k,)
    float32: NDArray[np.int64]  # (l,)
    uint8: NDArray[np.int64]  # (m,)


@compiled
def fill_rows(
    template: NDArray[np.uint8],
    places: NumberPlaces,
    stamps_ns: NDArray[np.int64],
    float64: FloatArray,
    float32: NDArray[np.float32],
    uint8: NDArray[np.uint8],
    rows: NDArray[np.uint8],
) -> None:
    """Write n copies of a message with other numbers.

    Args:
        template: Its bytes, padded to a multiple of eight.
        places: Offsets of its numbers.
        stamps_ns: (n,) [ns].
        float64: (n, k); (n, 0) leaves the template's numbers.
        float32: (n, l), or (n, 0).
        uint8: (n, m), or (n, 0).
        rows: Filled, (n, bytes).
    """
    for index in range(len(rows)):
        row = rows[index]
        row[:] = template
        doubles, singles = row.view(np.float64), row.view(np.float32)
        integers = row.view(np.uint32)
        for k in range(float64.shape[1]):
            doubles[places.float64[k]] = float64[index, k]
        for k in range(float32.shape[1]):
            singles[places.float32[k]] = float32[index, k]
        for k in range(uint8.shape[1]):
            row[places.uint8[k]] = uint8[index, k]
        for place in places.stamps:
            integers[place] = stamps_ns[index] // NS_PER_S
            integers[place + 1] = stamps_ns[index] % NS_PER_S
