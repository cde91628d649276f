"""Faults of IMUs: saturation, noise, twins, exchange, silence, garbage."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_bench.faults.fault import CAMERAS, Fault, Window, each, frozen, noise, often, put, silent
from pose_bench.faults.packets import Imu, Packet
from pose_core.stamps import NS_PER_S

SHANK, THIGH = "imu/left_shank", "imu/left_thigh"
ONE, NAMED = (SHANK,), ("left_shank",)
ANY = ("imu", "IMU")


def _turned(degrees: float, axis: str) -> Callable[[Imu, Window], Packet]:
    turn = Rotation.from_euler(axis, degrees, degrees=True)

    def slip(imu: Imu, _window: Window) -> Packet:
        turned = Rotation.from_quat(imu.orientation) * turn
        return replace(imu, orientation=turned.as_quat(), rate=turn.inv().apply(imu.rate))

    return slip


def _headed(imu: Imu, _window: Window) -> Packet:
    turn = Rotation.from_euler("z", 60.0, degrees=True)
    return replace(imu, orientation=(turn * Rotation.from_quat(imu.orientation)).as_quat())


def _random(imu: Imu, window: Window) -> Packet:
    q = window.rng.standard_normal(4)
    return replace(imu, orientation=q / np.linalg.norm(q), rate=window.rng.uniform(-30, 30, 3))


def _noisy(imu: Imu, window: Window) -> Packet:
    noise = Rotation.from_rotvec(0.5 * window.rng.standard_normal(3))
    return replace(imu, orientation=(Rotation.from_quat(imu.orientation) * noise).as_quat())


def _saturated(imu: Imu, _window: Window) -> Packet:
    """The orientation of a filter with a saturated gyroscope."""
    spin = Rotation.from_rotvec([0.0, 0.0, 35.0 * imu.at_s])
    return replace(imu, orientation=spin.as_quat(), rate=np.array([34.9, -34.9, 34.9]))


def _twin(imu: Imu, window: Window) -> Sequence[Packet]:
    """A second device with the same name and its own clock."""
    stamp_ns = imu.stamp_ns + int(window.rng.uniform(-5e9, 5e9))
    return [imu, replace(_random(imu, window), stamp_ns=stamp_ns)]


def _exchanged(imu: Imu, _window: Window) -> Packet:
    return replace(imu, source=THIGH if imu.source == SHANK else SHANK)


def _sometimes(imu: Imu, window: Window) -> Packet:
    """An impossible value in one sample of ten."""
    if window.rng.random() > 0.1:
        return imu
    return replace(imu, rate=np.full(3, 1e308), acceleration=np.full(3, 1e308))


def _denser(packet: Any, _window: Window) -> list[Packet]:
    """Four times the rate, each sample with its own stamp; IMUs are extrapolated by their rate."""
    period_s = (0.01 if isinstance(packet, Imu) else 1.0 / 30.0) / 4
    found = []
    for later_s in [k * period_s for k in range(4)]:
        stamp_ns = packet.stamp_ns + round(later_s * NS_PER_S)
        one = replace(packet, at_s=packet.at_s + later_s, stamp_ns=stamp_ns)
        if isinstance(packet, Imu):
            turn = Rotation.from_rotvec(packet.rate * later_s)
            turned = Rotation.from_quat(packet.orientation) * turn
            one = replace(one, orientation=turned.as_quat())
        found.append(one)
    return found


FAULTS = (
    Fault("one IMU: silent", silent(*ONE), ONE, NAMED),
    Fault("all IMUs: silent", silent("imus"), ("imus",), ANY),
    Fault("all IMUs: garbage", each(("imus",), noise(320)), ("imus",), ANY),
    Fault("one IMU: garbage", each(ONE, noise(320)), ONE, NAMED),
    Fault("one IMU: saturated", each(ONE, _saturated), ONE, NAMED),
    Fault("one IMU: random values", each(ONE, _random), ONE, NAMED),
    Fault("one IMU: noise of 30 degrees", each(ONE, _noisy), ONE, NAMED),
    Fault("one IMU: a twin with a clock of its own", each(ONE, _twin), ONE, NAMED),
    Fault("one IMU: stuck", each(ONE, frozen("orientation", "rate")), ONE, NAMED),
    Fault(
        "thigh and shank exchanged",
        each((SHANK, THIGH), _exchanged),
        (SHANK, THIGH),
        ("left_shank", "left_thigh"),
    ),
    Fault("one IMU: slips by 90 degrees", each(ONE, _turned(90.0, "y")), ONE, NAMED),
    Fault("one IMU: slips by 20 degrees", each(ONE, _turned(20.0, "x")), ONE),
    Fault("one IMU: heading jumps by 60 degrees", each(ONE, _headed), ONE),
    Fault("all IMUs: heading jumps by 60 degrees", each(("imus",), _headed)),
    Fault("one IMU: NaN", each(ONE, put(orientation=np.full(4, np.nan))), ONE, NAMED),
    Fault("one IMU: zero quaternions", each(ONE, put(orientation=np.zeros(4))), ONE, NAMED),
    Fault(
        "one IMU: quaternions ten times too long",
        each(ONE, lambda i, _: replace(i, orientation=10.0 * i.orientation)),
        ONE,
        NAMED,
    ),
    Fault("one IMU: rates infinite", each(ONE, put(rate=np.full(3, np.inf))), ONE, NAMED),
    Fault("one IMU: rates 1e30", each(ONE, put(rate=np.full(3, 1e30))), ONE, NAMED),
    Fault("one IMU: one sample in ten 1e308", each(ONE, _sometimes)),
    Fault("one IMU: says no orientation", each(ONE, put(variances=(-1.0, 0.0, 0.0))), ONE, NAMED),
    Fault("all IMUs: four times the rate", often(4, "imus")),
    Fault("everything: four times the samples", each(("imus", *CAMERAS), _denser)),
    Fault("one IMU: 1 kHz of one stamp", often(10, *ONE), said=NAMED),
)
"""Faults of IMUs."""
