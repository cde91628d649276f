"""Faults of clocks and stamps."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from pose_bench.faults.fault import (
    CAMERAS,
    Change,
    Fault,
    Signal,
    Window,
    each,
    noted,
    often,
    put,
    stamped,
)
from pose_bench.faults.packets import Packet
from pose_core.stamps import NS_PER_S

ONE, NAMED = ("imu/left_shank",), ("left_shank",)
YEAR_S = 31_557_600.0  # [s]
ZERO = put(stamp_ns=0)
L, R, B, I = ("left",), ("right",), CAMERAS, ("imus",)  # noqa: E741


def _frozen(packet: Any, window: Window) -> Packet:
    age_ns = round((packet.at_s - window.begin_s) * NS_PER_S)
    return replace(packet, stamp_ns=packet.stamp_ns - age_ns)


def _late(seconds: float, *sources: str) -> Change:
    """Delay the arrival; the stamps are unchanged."""
    return each(sources, lambda packet, _: replace(packet, at_s=packet.at_s + seconds))


def _backwards(packet: Packet, window: Window) -> float:
    return -2.0 * (packet.at_s - window.begin_s)


def _by(seconds: float) -> Callable[[Any, Window], float]:
    return lambda _packet, _window: seconds


def _jitter(seconds: float) -> Callable[[Any, Window], float]:
    return lambda _packet, window: window.rng.uniform(-seconds, seconds)


FAULTS = (
    Fault("right: stamps backwards", stamped(_backwards, *R), R, R),
    Fault("right: stamps zero", each(R, ZERO), R, R),
    Fault("right: stamps negative", stamped(_by(-2e9), *R), R, R),
    Fault("right: stamps 0.6 s late", stamped(_by(-0.6), *R), R, R),
    Fault("right: stamps 1 s late", stamped(_by(-1.0), *R), R, R),
    Fault("right: stamps 1.1 s late", stamped(_by(-1.1), *R), R, R),
    Fault("right: a year ahead", stamped(_by(YEAR_S), *R), R, R),
    Fault("right: clock +5 s", stamped(_by(5.0), *R), R, R),
    Fault("right: clock -5 s", stamped(_by(-5.0), *R), R, R),
    Fault("right: clock +0.3 s", stamped(_by(0.3), *R), R),
    Fault("right: stamps jitter 100 ms", stamped(_jitter(0.1), *R), R, R),
    Fault("right: one stamp for all", each(R, _frozen), R, R),
    Fault("right: random stamps", stamped(_jitter(1e6), *R), R, R),
    Fault("right: clock 500 ppm fast", stamped(lambda p, w: 5e-4 * (p.at_s - w.begin_s), *R)),
    Fault("left: stamps backwards", stamped(_backwards, *L), L, L),
    Fault("left: stamps zero", each(L, ZERO), L, L),
    Fault("left: clock +5 s", stamped(_by(5.0), *L), L, L),
    Fault("left: a year ahead", stamped(_by(YEAR_S), *L), L, L),
    Fault("both: a year ahead", stamped(_by(YEAR_S), *B), B, B),
    Fault("both: clock +5 s", stamped(_by(5.0), *B), B, B),
    Fault("both: clock -5 s", stamped(_by(-5.0), *B), B, B),
    Fault("both: stamps zero", each(B, ZERO), B, B),
    Fault("both: frames 1 s late", _late(1.0, *B), B, B),
    Fault("right: frames 0.4 s late", _late(0.4, *R), R),
    Fault("right: 1 kHz of one stamp", often(33, *R), said=R),
    Fault("both: 1 kHz", often(33, *B), said=B),
    Fault(
        "right: node starts again, two epochs mixed",
        each(R, lambda p, w: [p, replace(p, stamp_ns=p.stamp_ns - 60 * NS_PER_S)]),
        said=R,
    ),
    Fault("one IMU late by 0.4 s", _late(0.4, *ONE), ONE, NAMED),
    Fault("one IMU: stamps zero", each(ONE, ZERO), ONE, NAMED),
    Fault("one IMU: a year ahead", stamped(_by(YEAR_S), *ONE), ONE, NAMED),
    Fault("one IMU: stamps 1.1 s late", stamped(_by(-1.1), *ONE), ONE, NAMED),
    Fault("one IMU: stamps backwards", stamped(_backwards, *ONE), ONE, NAMED),
    Fault("all IMUs: clock +5 s", stamped(_by(5.0), *I), I, ("imu", "IMU")),
    Fault("clock_offsets: 1.1 s", noted("clock_offsets", source="right", offset_ns=1.1e9), said=R),
    Fault(
        "clock_offsets: a century", noted("clock_offsets", source="right", offset_ns=3e18), said=R
    ),
    *(
        Fault(
            f"fusion paused for {pause_s:g} s",
            signals=(Signal("pause", "fusion"), Signal("resume", "fusion", pause_s)),
            lasts_s=pause_s,
            silent=True,
        )
        for pause_s in (2.0, 8.0)
    ),
)
"""Faults of clocks and stamps."""
