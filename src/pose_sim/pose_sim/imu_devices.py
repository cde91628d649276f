"""A session's IMU nodes as devices of several kinds: the data and times of each port."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imu_bridge.protocols.star import CLOCK_MODULUS_US
from pose_io.arrays import IntArray
from pose_sim import imu_file, text_device, witmotion_device
from pose_sim.virtual_imu import LSB, NODES, ImuFrames

BAUDRATES: dict[str, int | None] = {"star": None, "witmotion": 115200, "text": 115200}
"""Speed [bit/s] of the devices by their protocol in a nodes file.

None is USB, where any speed is accepted.
"""

_ENCODERS: dict[str, Callable[..., bytes]] = {
    "witmotion": witmotion_device.packets,
    "text": text_device.line,
}


def port_streams(
    device: str, frames: ImuFrames
) -> dict[str | None, tuple[IntArray, tuple[bytes, ...]]]:
    """A session's frames as the data of each port.

    Args:
        device: A key of :data:`BAUDRATES`.
        frames: The frames.

    Returns:
        Times of arrival [ns] from the session's start, (n,), and the bytes that arrive then; by
        the segment of the port's only sensor, which is None for the sink of the star network.
    """
    if device == "star":
        return {None: (frames.due_ns, tuple(imu_file.encode_all(frames)))}
    streams: dict[str | None, tuple[IntArray, tuple[bytes, ...]]] = {}
    for node_id, segment in NODES.items():
        rows = np.flatnonzero(frames.node_id == node_id)
        pieces = tuple(_ENCODERS[device](**sample) for sample in _samples(frames, rows))
        streams[segment] = frames.due_ns[rows], pieces
    return streams


def _samples(frames: ImuFrames, rows: NDArray[np.intp]) -> Iterator[dict[str, Any]]:
    """The arguments of an encoder: the clock from the first sample on, the rest in SI units."""
    clock_us = frames.clock_us[rows].astype(np.int64)
    columns = {
        "time_us": ((clock_us - clock_us[0]) % CLOCK_MODULUS_US).tolist(),
        "acceleration": frames.accelerometer[rows] * LSB["accelerometer"],
        "angular_velocity": frames.gyroscope[rows] * LSB["gyroscope"],
        "magnetic_field": frames.magnetometer[rows] * LSB["magnetometer"],
    }
    for sample in zip(*columns.values(), strict=True):
        yield dict(zip(columns, sample, strict=True))


def nodes_file(device: str, ports: dict[str, str]) -> dict:
    """The content of a nodes file for such devices.

    Args:
        device: A key of :data:`BAUDRATES`.
        ports: Port by segment; empty for the star network, whose port is a parameter.
    """
    if device == "star":
        return {"nodes": dict(NODES)}
    entry: dict = {"protocol": device, "baudrate": BAUDRATES[device]}
    if device == "text":
        entry |= {"fields": list(text_device.FIELDS), "units": dict(text_device.UNITS)}
    return {"ports": {port: {**entry, "segment": segment} for segment, port in ports.items()}}
