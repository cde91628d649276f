"""Packets of sensors before serialisation."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pose_core.api import ImuSample, SkeletonSample
from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS
from pose_core.stamps import NS_PER_S
from pose_io.arrays import ByteArray
from pose_sim.captured.session import START_NS, CapturedSession

CAMERA_DELAY_S, IMU_DELAY_S = 0.02, 0.005  # [s] from capture to publication
IMU_VARIANCES = (4e-4, 4e-4, 0.04)  # [rad²] of an orientation: tilt, tilt, heading


@dataclass(frozen=True, kw_only=True)
class FramePerson:
    """One person in a frame."""

    id: str
    names: tuple[str, ...]
    positions: FloatArray  # (n, 3) [m]
    states: ByteArray  # (n,)


@dataclass(frozen=True, kw_only=True)
class Packet:
    """A message to publish: a camera's frame, an IMU's sample, or another message."""

    at_s: float  # after the session's start [s]
    source: str  # left, right; imu/<segment>; or the kind of a note
    stamp_ns: int
    raw: bytes | None = None  # replaces the serialised message
    cut: int | None = None  # [bytes] of the serialised message to keep
    flips: tuple[int, ...] = ()  # [bytes] offsets whose bits are inverted, modulo the length


@dataclass(frozen=True, kw_only=True)
class Frame(Packet):
    """A camera's frame."""

    persons: tuple[FramePerson, ...]
    frame_id: str | None = None  # None: the camera's own


@dataclass(frozen=True, kw_only=True)
class Imu(Packet):
    """An IMU's sample."""

    orientation: FloatArray  # (4,) x y z w
    rate: FloatArray  # (3,) [rad/s]
    acceleration: FloatArray = field(default_factory=lambda: np.zeros(3))  # (3,) [m/s²]
    variances: tuple[float, float, float] = IMU_VARIANCES


@dataclass(frozen=True, kw_only=True)
class Note(Packet):
    """A message of another kind: ``tf_static``, ``clock_offsets``, ``diagnostics``."""

    values: Mapping[str, Any] = field(default_factory=dict)


def packets_of(session: CapturedSession) -> list[Packet]:
    """All packets of a session's sensors without faults, in the order of publication."""
    packets = [packet_of(sample) for sample in session.samples(imus=True)]
    return sorted(packets, key=lambda packet: packet.at_s)


def packet_of(*samples: SkeletonSample | ImuSample) -> Packet:
    """The packet of an IMU's sample, or of the persons in one frame, of a captured session."""
    first = samples[0]
    captured_s = (first.stamp_ns - START_NS) / NS_PER_S
    if isinstance(first, ImuSample):
        return Imu(
            at_s=captured_s + IMU_DELAY_S,
            source=f"imu/{first.segment}",
            stamp_ns=first.stamp_ns,
            orientation=first.orientation,
            rate=first.angular_velocity,
        )
    persons = (
        FramePerson(id=p.person, names=JOINTS, positions=p.positions, states=p.tracking_state)
        for p in samples
        if isinstance(p, SkeletonSample)
    )
    return Frame(
        at_s=captured_s + CAMERA_DELAY_S,
        source=first.sensor,
        stamp_ns=first.stamp_ns,
        persons=tuple(persons),
    )
