"""Faults of IMUs: saturation, noise, twins, exchange, silence, garbage."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_bench.faults.fault import CAMERAS, NS, Fault, Window, each, often, silent
from pose_bench.faults.packets import Imu, Packet

SHANK, THIGH = "imu/left_shank", "imu/left_thigh"
ONE, NAMED = (SHANK,), ("left_shank",)
ANY = ("imu", "IMU")


def _turned(degrees: float, axis: str) -> Callable[[Imu, Window], Packet]:
    turn = Rotation.from_euler(axis, degrees, degrees=True)

    def slip(imu: Imu, _window: Window) -> Packet:
        turned = Rotation.from_quat(imu.orientation) * turn
        return replace(imu, orientation=turned.as_quat(), rate=turn.inv().apply(imu.rate))

    return slip


def _headed(degrees: float) -> Callable[[Imu, Window], Packet]:
    turn = Rotation.from_euler("z", degrees, degrees=True)

    def jump(imu: Imu, _window: Window) -> Packet:
        return replace(imu, orientation=(turn * Rotation.from_quat(imu.orientation)).as_quat())

    return jump


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


class _Stuck:
    """Repeats the last value."""

    def __init__(self) -> None:
        self._last: dict[tuple[float, str], Imu] = {}

    def __call__(self, imu: Imu, window: Window) -> Packet:
        last = self._last.setdefault((window.begin_s, imu.source), imu)
        return replace(imu, orientation=last.orientation, rate=last.rate)


def _of(**fields: Any) -> Callable[[Any, Window], Packet]:
    return lambda imu, _window: replace(imu, **fields)


def _rates(value: float) -> dict[str, Any]:
    return {"rate": np.full(3, value)}


def _once(value: float) -> Callable[[Imu, Window], Packet]:
    """Replaces one sample in ten by an impossible value."""

    def sometimes(imu: Imu, window: Window) -> Packet:
        if window.rng.random() > 0.1:
            return imu
        return replace(imu, rate=np.full(3, value), acceleration=np.full(3, value))

    return sometimes


def _garbage(packet: Any, window: Window) -> Packet:
    return replace(packet, raw=window.rng.bytes(320))


def _denser(times: int) -> Callable[[Any, Window], Sequence[Packet]]:
    """Multiply the rate, each sample with its own stamp; IMUs are extrapolated by their rate."""

    def more(packet: Any, _window: Window) -> list[Packet]:
        period_s = (0.01 if isinstance(packet, Imu) else 1.0 / 30.0) / times
        found = []
        for later_s in [k * period_s for k in range(times)]:
            stamp_ns = packet.stamp_ns + round(later_s * NS)
            one = replace(packet, at_s=packet.at_s + later_s, stamp_ns=stamp_ns)
            if isinstance(packet, Imu):
                turn = Rotation.from_rotvec(packet.rate * later_s)
                turned = Rotation.from_quat(packet.orientation) * turn
                one = replace(one, orientation=turned.as_quat())
            found.append(one)
        return found

    return more


FAULTS = (
    Fault(name="one IMU: silent", change=silent(*ONE), lost=ONE, said=NAMED),
    Fault(name="all IMUs: silent", change=silent("imus"), lost=("imus",), said=ANY),
    Fault(name="all IMUs: garbage", change=each(("imus",), _garbage), lost=("imus",), said=ANY),
    Fault(name="one IMU: garbage", change=each(ONE, _garbage), lost=ONE, said=NAMED),
    Fault(name="one IMU: saturated", change=each(ONE, _saturated), lost=ONE, said=NAMED),
    Fault(name="one IMU: random values", change=each(ONE, _random), lost=ONE, said=NAMED),
    Fault(name="one IMU: noise of 30 degrees", change=each(ONE, _noisy), lost=ONE, said=NAMED),
    Fault(
        name="one IMU: a twin with a clock of its own",
        change=each(ONE, _twin),
        lost=ONE,
        said=NAMED,
    ),
    Fault(name="one IMU: stuck", change=each(ONE, _Stuck()), lost=ONE, said=NAMED),
    Fault(
        name="thigh and shank exchanged",
        change=each((SHANK, THIGH), _exchanged),
        lost=(SHANK, THIGH),
        said=("left_shank", "left_thigh"),
    ),
    Fault(
        name="one IMU: slips by 90 degrees",
        change=each(ONE, _turned(90.0, "y")),
        lost=ONE,
        said=NAMED,
    ),
    Fault(name="one IMU: slips by 20 degrees", change=each(ONE, _turned(20.0, "x")), lost=ONE),
    Fault(name="one IMU: heading jumps by 60 degrees", change=each(ONE, _headed(60.0)), lost=ONE),
    Fault(name="all IMUs: heading jumps by 60 degrees", change=each(("imus",), _headed(60.0))),
    Fault(
        name="one IMU: NaN",
        change=each(ONE, _of(orientation=np.full(4, np.nan))),
        lost=ONE,
        said=NAMED,
    ),
    Fault(
        name="one IMU: zero quaternions",
        change=each(ONE, _of(orientation=np.zeros(4))),
        lost=ONE,
        said=NAMED,
    ),
    Fault(
        name="one IMU: quaternions ten times too long",
        change=each(ONE, lambda i, _: replace(i, orientation=10.0 * i.orientation)),
        lost=ONE,
        said=NAMED,
    ),
    Fault(
        name="one IMU: rates infinite",
        change=each(ONE, _of(**_rates(np.inf))),
        lost=ONE,
        said=NAMED,
    ),
    Fault(name="one IMU: rates 1e30", change=each(ONE, _of(**_rates(1e30))), lost=ONE, said=NAMED),
    Fault(name="one IMU: one sample in ten 1e308", change=each(ONE, _once(1e308))),
    Fault(
        name="one IMU: says no orientation",
        change=each(ONE, _of(variances=(-1.0, 0.0, 0.0))),
        lost=ONE,
        said=NAMED,
    ),
    Fault(name="all IMUs: four times the rate", change=often(4, "imus")),
    Fault(name="everything: four times the samples", change=each(("imus", *CAMERAS), _denser(4))),
    Fault(name="one IMU: 1 kHz of one stamp", change=often(10, *ONE), said=NAMED),
)
"""Faults of IMUs."""
