"""Virtual IMU nodes: gyroscope, accelerometer and magnetometer on a moving segment.

With ``R`` = ``R_map_sensor``, ``a`` the sensor's acceleration and ``B`` the field at its position:
gyroscope ``ω`` (in the sensor's frame), accelerometer ``Rᵀ (a + g ẑ)``, magnetometer ``Rᵀ B``.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from imu_bridge.protocols import star
from imu_bridge.protocols.reading import STANDARD_GRAVITY
from imu_bridge.sequence import SEQUENCE_MODULUS
from pose_core.arrays import FloatArray
from pose_core.joints import SIDE_SIGNS
from pose_core.stamps import NS_PER_S
from pose_io.arrays import ByteArray, IntArray
from pose_sim.body import Body
from pose_sim.imu_noise import ImuParameters
from pose_sim.motion import Motion

RANGES = {"accelerometer": 2, "gyroscope": 3, "magnetometer": 0}
"""Codes of the sensors' ranges: +-8 g, +-2000 deg/s, 0.3 uT per count."""
LSB = {
    "accelerometer": star.ACCELEROMETER_LSB[RANGES["accelerometer"]],  # [m/s^2]
    "gyroscope": star.GYROSCOPE_LSB[RANGES["gyroscope"]],  # [rad/s]
    "magnetometer": star.MAGNETOMETER_LSB[RANGES["magnetometer"]],  # [T]
}
"""Size of one count of each sensor."""

NODES: dict[int, str] = {
    1: "torso",
    2: "left_upper_arm",
    3: "left_forearm",
    4: "right_upper_arm",
    5: "right_forearm",
    6: "left_thigh",
    7: "left_shank",
    8: "right_thigh",
    9: "right_shank",
}
"""Segment of each node by its id."""

STRAP_PLACES = {  # fractions of the body height, in the segment's frame
    "torso": (0.070, 0.0, 0.080),  # on the breastbone
    "upper_arm": (0.0, 0.028, -0.10),  # outside; mirrored for the right
    "forearm": (0.0, 0.020, -0.11),
    "thigh": (0.0, 0.045, -0.13),
    "shank": (0.028, 0.0, -0.09),  # on the shin bone
}


@dataclass(frozen=True, kw_only=True)
class WornNode:
    """Where one node is worn in a session, and its constant errors."""

    segment: str
    place: FloatArray  # (3,) [m] in the segment's frame
    R_segment_sensor: Rotation
    gyroscope_bias: FloatArray  # (3,) [rad/s] at the start
    accelerometer_bias: FloatArray  # (3,) [m/s^2]
    disturbance: FloatArray  # (3,) [T] in map


@dataclass(frozen=True, kw_only=True)
class Measurements:
    """Measurements of one node in SI units, before quantisation."""

    sample_s: FloatArray  # (n,) [s] true time of sampling on the host's clock
    clock_us: IntArray  # (n,) [us] on the node's clock, not wrapped
    angular_velocity: FloatArray  # (n, 3) [rad/s]
    specific_force: FloatArray  # (n, 3) [m/s^2]
    magnetic_field: FloatArray  # (n, 3) [T]


@dataclass(frozen=True, kw_only=True)
class ImuFrames:
    """All nodes' frames in the order in which they reach the host."""

    due_ns: IntArray  # (n,) [ns] on the host's clock, from the session's start
    node_id: ByteArray  # (n,)
    sequence: NDArray[np.uint16]  # (n,)
    clock_us: NDArray[np.uint32]  # (n,)
    accelerometer: NDArray[np.int16]  # (n, 3) counts
    gyroscope: NDArray[np.int16]  # (n, 3) counts
    magnetometer: NDArray[np.int16]  # (n, 3) counts


def mount(body: Body, parameters: ImuParameters, rng: np.random.Generator) -> dict[int, WornNode]:
    """Draw where all nodes are worn, and their biases, by node id."""
    nodes = {}
    for node_id, segment in NODES.items():
        side, _, part = segment.rpartition("_") if segment == "torso" else segment.partition("_")
        mirror = np.array([1.0, SIDE_SIGNS.get(side, 1.0), 1.0])
        axis = rng.standard_normal(3)
        angle = np.radians(rng.uniform(parameters.misalignment_min, parameters.misalignment_max))
        nodes[node_id] = WornNode(
            segment=segment,
            place=body.height * np.array(STRAP_PLACES[part]) * mirror,
            R_segment_sensor=Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)),
            gyroscope_bias=np.radians(parameters.gyroscope_bias) * rng.standard_normal(3),
            accelerometer_bias=parameters.accelerometer_bias * rng.standard_normal(3),
            disturbance=1e-6 * parameters.disturbance * rng.standard_normal(3),
        )
    return nodes


def earth_field(parameters: ImuParameters, heading_enu_map: float) -> FloatArray:
    """The undisturbed field [T] in ``map``, shape (3,).

    Args:
        parameters: Strength and dip.
        heading_enu_map: Angle [rad] about z from east to ``map``'s x.
    """
    dip = np.radians(parameters.field_dip)
    enu = 1e-6 * parameters.field_strength * np.array([0.0, np.cos(dip), -np.sin(dip)])
    return Rotation.from_euler("z", -heading_enu_map).apply(enu)


def measure(
    motion: Motion,
    node: WornNode,
    field: FloatArray,
    parameters: ImuParameters,
    rng: np.random.Generator,
) -> Measurements:
    """Simulate the measurements of one node.

    Args:
        motion: The subject's motion.
        node: Where it is worn, and its biases.
        field: The undisturbed magnetic field [T] in ``map``, shape (3,).
        parameters: Rates and noise.
        rng: Random generator.
    """
    times, clock_us = _clock(float(motion.times[-1]), parameters, rng)
    path = motion.segment(node.segment, node.place)
    R_sensor_map = (path.rotation(times) * node.R_segment_sensor).inv()
    turning = node.R_segment_sensor.inv().apply(path.angular_velocity(times))
    force = R_sensor_map.apply(path.acceleration(times) + np.array([0.0, 0.0, STANDARD_GRAVITY]))
    disturbed = field + node.disturbance + _slow_change(times, parameters, rng)
    count = len(times)
    walk = np.radians(parameters.gyroscope_bias_walk) / np.sqrt(parameters.sample_rate)
    drift = walk * np.cumsum(rng.standard_normal((count, 3)), axis=0)
    noise = rng.standard_normal((3, count, 3))
    gyroscope_noise = np.radians(parameters.gyroscope_noise) * noise[0]
    return Measurements(
        sample_s=times,
        clock_us=clock_us,
        angular_velocity=turning + node.gyroscope_bias + drift + gyroscope_noise,
        specific_force=force + node.accelerometer_bias + parameters.accelerometer_noise * noise[1],
        magnetic_field=R_sensor_map.apply(disturbed)
        + 1e-6 * parameters.magnetometer_noise * noise[2],
    )


def to_frames(
    measurements: Mapping[int, Measurements], parameters: ImuParameters, rng: np.random.Generator
) -> ImuFrames:
    """Quantise all nodes' measurements; frames in the order of their arrival."""
    columns: dict[str, list[NDArray]] = {name: [] for name in ImuFrames.__dataclass_fields__}
    for node_id, measured in measurements.items():
        count = len(measured.sample_s)
        late = parameters.radio_latency + rng.exponential(1.0, count) * parameters.radio_jitter
        # A node's frames keep their order.
        arrival = np.maximum.accumulate(measured.sample_s + late)
        columns["due_ns"].append(np.round(arrival * NS_PER_S).astype(np.int64))
        columns["node_id"].append(np.full(count, node_id, dtype=np.uint8))
        sequence = (rng.integers(SEQUENCE_MODULUS) + np.arange(count)) % SEQUENCE_MODULUS
        columns["sequence"].append(sequence.astype(np.uint16))
        columns["clock_us"].append((measured.clock_us % star.CLOCK_MODULUS_US).astype(np.uint32))
        for name, values in (
            ("accelerometer", measured.specific_force),
            ("gyroscope", measured.angular_velocity),
            ("magnetometer", measured.magnetic_field),
        ):
            columns[name].append(star.quantise(values, LSB[name]))
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    order = np.argsort(joined["due_ns"], kind="stable")
    return ImuFrames(**{name: column[order] for name, column in joined.items()})


def _clock(
    duration: float, p: ImuParameters, rng: np.random.Generator
) -> tuple[FloatArray, IntArray]:
    """Sampling times [s] on the host's clock and on the node's clock [us], which is regular."""
    period = 1.0 / p.sample_rate
    phase, boot = rng.uniform(0.0, period), rng.uniform(5.0, 3000.0)  # [s]
    drift = 1e-6 * p.clock_drift * rng.standard_normal()
    steps = np.arange(int(duration * p.sample_rate) + 2)
    times = (phase + steps * period * (1.0 - drift)).astype(np.float64)
    clock_us = np.round(1e6 * (boot + steps * period)).astype(np.int64)
    inside = times <= duration
    return times[inside], clock_us[inside]


def _slow_change(times: FloatArray, p: ImuParameters, rng: np.random.Generator) -> FloatArray:
    """A magnetic disturbance with periods of 17 s to 100 s [T], shape (n, 3)."""
    frequencies = rng.uniform(0.01, 0.06, 3)  # [Hz]
    phases = rng.uniform(0.0, 2.0 * np.pi, 3)
    waves = np.sin(2.0 * np.pi * frequencies * times[:, None] + phases)
    return 1e-6 * p.disturbance_change * np.sqrt(2.0) * waves
