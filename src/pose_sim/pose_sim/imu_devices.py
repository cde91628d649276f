"""A session's IMU nodes as devices of several kinds: the data and times of each port."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imu_bridge.protocols.star import (
    ACCELEROMETER_LSB,
    CLOCK_MODULUS_US,
    GYROSCOPE_LSB,
    MAGNETOMETER_LSB,
)
from pose_sim import imu_file, text_device, witmotion_device
from pose_sim.virtual_imu import (
    ACCELEROMETER_RANGE,
    GYROSCOPE_RANGE,
    MAGNETOMETER_RANGE,
    NODES,
    ImuFrames,
)


@dataclass(frozen=True, kw_only=True)
class PortStream:
    """Data sent by one port.

    Attributes:
        segment: The segment of its only sensor; None for the sink of the star network.
        due_ns: Time of arrival of each piece [ns], from the session's start, shape (n,).
        pieces: The bytes that arrive at these times.
    """

    segment: str | None
    due_ns: NDArray[np.int64]
    pieces: tuple[bytes, ...]


@dataclass(frozen=True, kw_only=True)
class SimulatedDevice:
    """A kind of device, with the encoding of a session's frames.

    Attributes:
        baudrate: Its speed [bit/s]; None for USB, where any speed is accepted.
        streams: Function that returns the data of each port.
    """

    baudrate: int | None
    streams: Callable[[ImuFrames], list[PortStream]]


def _star(frames: ImuFrames) -> list[PortStream]:
    pieces = tuple(imu_file.encode_all(frames))
    return [PortStream(segment=None, due_ns=frames.due_ns, pieces=pieces)]


def _witmotion(frames: ImuFrames) -> list[PortStream]:
    return _one_a_port(
        frames,
        lambda clock_us, acceleration, rate, field: witmotion_device.packets(
            witmotion_device.Sampling(
                acceleration=acceleration, angular_velocity=rate, magnetic_field=field
            )
        ),
    )


def _text(frames: ImuFrames) -> list[PortStream]:
    return _one_a_port(frames, text_device.line)


def _one_a_port(frames: ImuFrames, encode: Callable[..., bytes]) -> list[PortStream]:
    streams = []
    for node_id, segment in NODES.items():
        rows = np.flatnonzero(frames.node_id == node_id)
        pieces = tuple(encode(*sample) for sample in _samples(frames, rows))
        streams.append(PortStream(segment=segment, due_ns=frames.due_ns[rows], pieces=pieces))
    return streams


def _samples(frames: ImuFrames, rows: NDArray[np.intp]) -> Iterator[tuple]:
    """Clock [us] since the first sample, acceleration, angular velocity and field in SI units."""
    clock_us = (frames.clock_us[rows].astype(np.int64) - int(frames.clock_us[rows[0]])) % (
        CLOCK_MODULUS_US
    )
    return zip(
        clock_us.tolist(),
        frames.accelerometer[rows] * ACCELEROMETER_LSB[ACCELEROMETER_RANGE],
        frames.gyroscope[rows] * GYROSCOPE_LSB[GYROSCOPE_RANGE],
        frames.magnetometer[rows] * MAGNETOMETER_LSB[MAGNETOMETER_RANGE],
        strict=True,
    )


DEVICES: dict[str, SimulatedDevice] = {
    "star": SimulatedDevice(baudrate=None, streams=_star),
    "witmotion": SimulatedDevice(baudrate=115200, streams=_witmotion),
    "text": SimulatedDevice(baudrate=115200, streams=_text),
}
"""Devices by the name of their protocol in a nodes file."""


def nodes_file(device: str, ports: dict[str, str]) -> dict:
    """The content of a nodes file for such devices.

    Args:
        device: A key of :data:`DEVICES`.
        ports: Port by segment; empty for the star network, whose port is a parameter.
    """
    if device == "star":
        return {"nodes": dict(NODES)}
    entry: dict = {"protocol": device, "baudrate": DEVICES[device].baudrate}
    if device == "text":
        entry |= {"fields": list(text_device.FIELDS), "units": dict(text_device.UNITS)}
    return {"ports": {port: {**entry, "segment": segment} for segment, port in ports.items()}}
