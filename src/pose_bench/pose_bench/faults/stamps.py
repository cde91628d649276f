"""Faults of clocks and stamps."""

from dataclasses import replace
from typing import Any

from pose_bench.faults.fault import CAMERAS, NS, Change, Fault, Signal, Window, each, often, stamped
from pose_bench.faults.packets import Note, Packet

YEAR_S = 31_557_600.0  # [s]
SHANK = "imu/left_shank"
R, B, I = ("right",), CAMERAS, ("imus",)  # noqa: E741


def _zero(packet: Any, _window: Window) -> Packet:
    return replace(packet, stamp_ns=0)


def _frozen(packet: Any, window: Window) -> Packet:
    age_ns = round((packet.at_s - window.begin_s) * NS)
    return replace(packet, stamp_ns=packet.stamp_ns - age_ns)


def _late(seconds: float, *sources: str) -> Change:
    """Delay the arrival; the stamps are unchanged."""
    return each(sources, lambda packet, _: replace(packet, at_s=packet.at_s + seconds))


def _clock_message(offset_ns: float) -> Change:
    def add(packets: list[Packet], window: Window) -> list[Packet]:
        first = next(packet for packet in packets if packet in window)
        values = {"source": "right", "offset_ns": offset_ns}
        note = Note(
            at_s=window.begin_s, source="clock_offsets", stamp_ns=first.stamp_ns, values=values
        )
        return sorted([*packets, note], key=lambda one: one.at_s)

    return add


def _backwards(packet: Packet, window: Window) -> float:
    return -2.0 * (packet.at_s - window.begin_s)


def _by(seconds: float):  # type: ignore[no-untyped-def]
    return lambda _packet, _window: seconds


def _jitter(seconds: float):  # type: ignore[no-untyped-def]
    return lambda _packet, window: window.rng.uniform(-seconds, seconds)


FAULTS = (
    Fault(name="right: stamps backwards", change=stamped(_backwards, *R), lost=R, said=R),
    Fault(name="right: stamps zero", change=each(R, _zero), lost=R, said=R),
    Fault(name="right: stamps negative", change=stamped(_by(-2e9), *R), lost=R, said=R),
    Fault(name="right: stamps 0.6 s late", change=stamped(_by(-0.6), *R), lost=R, said=R),
    Fault(name="right: stamps 1 s late", change=stamped(_by(-1.0), *R), lost=R, said=R),
    Fault(name="right: stamps 1.1 s late", change=stamped(_by(-1.1), *R), lost=R, said=R),
    Fault(name="right: a year ahead", change=stamped(_by(YEAR_S), *R), lost=R, said=R),
    Fault(name="right: clock +5 s", change=stamped(_by(5.0), *R), lost=R, said=R),
    Fault(name="right: clock -5 s", change=stamped(_by(-5.0), *R), lost=R, said=R),
    Fault(name="right: clock +0.3 s", change=stamped(_by(0.3), *R), lost=R),
    Fault(name="right: stamps jitter 100 ms", change=stamped(_jitter(0.1), *R), lost=R, said=R),
    Fault(name="right: one stamp for all", change=each(R, _frozen), lost=R, said=R),
    Fault(name="right: random stamps", change=stamped(_jitter(1e6), *R), lost=R, said=R),
    Fault(
        name="right: clock 500 ppm fast",
        change=stamped(lambda p, w: 5e-4 * (p.at_s - w.begin_s), *R),
    ),
    Fault(
        name="left: stamps backwards",
        change=stamped(_backwards, "left"),
        lost=("left",),
        said=("left",),
    ),
    Fault(name="left: stamps zero", change=each(("left",), _zero), lost=("left",), said=("left",)),
    Fault(
        name="left: clock +5 s", change=stamped(_by(5.0), "left"), lost=("left",), said=("left",)
    ),
    Fault(
        name="left: a year ahead",
        change=stamped(_by(YEAR_S), "left"),
        lost=("left",),
        said=("left",),
    ),
    Fault(name="both: a year ahead", change=stamped(_by(YEAR_S), *B), lost=B, said=B),
    Fault(name="both: clock +5 s", change=stamped(_by(5.0), *B), lost=B, said=B),
    Fault(name="both: clock -5 s", change=stamped(_by(-5.0), *B), lost=B, said=B),
    Fault(name="both: stamps zero", change=each(B, _zero), lost=B, said=B),
    Fault(name="both: frames 1 s late", change=_late(1.0, *B), lost=B, said=B),
    Fault(name="right: frames 0.4 s late", change=_late(0.4, *R), lost=R),
    Fault(name="right: 1 kHz of one stamp", change=often(33, *R), said=R),
    Fault(name="both: 1 kHz", change=often(33, *B), said=B),
    Fault(
        name="right: node starts again, two epochs mixed",
        change=each(R, lambda p, w: [p, replace(p, stamp_ns=p.stamp_ns - 60 * NS)]),
        said=R,
    ),
    Fault(
        name="one IMU late by 0.4 s", change=_late(0.4, SHANK), lost=(SHANK,), said=("left_shank",)
    ),
    Fault(
        name="one IMU: stamps zero",
        change=each((SHANK,), _zero),
        lost=(SHANK,),
        said=("left_shank",),
    ),
    Fault(
        name="one IMU: a year ahead",
        change=stamped(_by(YEAR_S), SHANK),
        lost=(SHANK,),
        said=("left_shank",),
    ),
    Fault(
        name="one IMU: stamps 1.1 s late",
        change=stamped(_by(-1.1), SHANK),
        lost=(SHANK,),
        said=("left_shank",),
    ),
    Fault(
        name="one IMU: stamps backwards",
        change=stamped(_backwards, SHANK),
        lost=(SHANK,),
        said=("left_shank",),
    ),
    Fault(name="all IMUs: clock +5 s", change=stamped(_by(5.0), *I), lost=I, said=("imu", "IMU")),
    Fault(name="clock_offsets: 1.1 s", change=_clock_message(1.1e9), said=R),
    Fault(name="clock_offsets: a century", change=_clock_message(3e18), said=R),
    Fault(
        name="fusion paused for 2 s",
        signals=(
            Signal(after_s=0.0, what="pause", node="fusion"),
            Signal(after_s=2.0, what="resume", node="fusion"),
        ),
        lasts_s=2.0,
        silent=True,
    ),
    Fault(
        name="fusion paused for 8 s",
        signals=(
            Signal(after_s=0.0, what="pause", node="fusion"),
            Signal(after_s=8.0, what="resume", node="fusion"),
        ),
        lasts_s=8.0,
        silent=True,
    ),
)
"""Faults of clocks and stamps."""
