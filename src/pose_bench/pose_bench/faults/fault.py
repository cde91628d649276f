"""What a fault is, and the small functions that most faults are made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pose_bench.faults.packets import Frame, Imu, Packet, Person

FAULT_S = 4.0  # [s] for which a fault lasts
NS = 1_000_000_000
CAMERAS = ("left", "right")


@dataclass(frozen=True)
class Window:
    """The time of a fault [s] after the session's start, and randomness of its own."""

    begin_s: float
    end_s: float
    rng: np.random.Generator

    def __contains__(self, packet: object) -> bool:
        return isinstance(packet, Packet) and self.begin_s <= packet.at_s < self.end_s

    def share(self, packet: Packet) -> float:
        """How much of the window has passed, 0 to 1."""
        return (packet.at_s - self.begin_s) / (self.end_s - self.begin_s)


Change = Callable[[list[Packet], Window], list[Packet]]
"""From the session's packets to those that are published."""


@dataclass(frozen=True, kw_only=True)
class Signal:
    """What is done to a process of the graph.

    Attributes:
        after_s: How long after the fault's beginning [s].
        what: ``kill``, ``pause``, ``resume``, or ``start`` (one more of the same).
        node: Executable of :mod:`pose_fusion`.
    """

    after_s: float
    what: str
    node: str


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One fault.

    Attributes:
        name: In the table, and for ``--only``.
        change: What it does to the packets; None if it acts on processes alone.
        lost: Sources that cannot be used meanwhile: ``left``, ``right``, ``imu/<segment>``,
            ``imus`` for all.
        said: Words, one of which a warning in ``/diagnostics`` must have; none: no fault of a
            sensor that anybody has to know.
        signals: To processes.
        lasts_s: How long [s].
        silent: Whether nothing can be known meanwhile: silence is then as good as estimates.
        known: Why a bound does not hold yet, where that is known.
    """

    name: str
    change: Change | None = None
    lost: tuple[str, ...] = ()
    said: tuple[str, ...] = ()
    signals: tuple[Signal, ...] = ()
    lasts_s: float = FAULT_S
    silent: bool = False
    known: str = ""


def each(sources: Sequence[str], to: Callable[[Any, Window], Packet | Sequence[Packet]]) -> Change:
    """Change every packet of some sources (``imus``: of all IMUs) into another, several or none."""

    def change(packets: list[Packet], window: Window) -> list[Packet]:
        result: list[Packet] = []
        for packet in packets:
            if packet not in window or not is_of(packet, sources):
                result.append(packet)
                continue
            changed = to(packet, window)
            result.extend([changed] if isinstance(changed, Packet) else changed)
        return sorted(result, key=lambda one: one.at_s)

    return change


def is_of(packet: Packet, sources: Sequence[str]) -> bool:
    """Whether a packet is of one of these sources."""
    return packet.source in sources or (isinstance(packet, Imu) and "imus" in sources)


def silent(*sources: str) -> Change:
    """Nothing of these sources."""
    return each(sources, lambda _packet, _window: ())


def stamped(to: Callable[[Any, Window], float], *sources: str) -> Change:
    """Stamps moved by so many seconds."""

    def move(packet: Any, window: Window) -> Packet:
        moved: Packet = replace(packet, stamp_ns=packet.stamp_ns + round(to(packet, window) * NS))
        return moved

    return each(sources, move)


def placed(to: Callable[[np.ndarray, Window], np.ndarray], *sources: str) -> Change:
    """The positions of everybody in a camera's frames changed, (n, 3) to (n, 3) [m]."""

    def move(frame: Frame, window: Window) -> Packet:
        persons = [replace(one, positions=to(one.positions, window)) for one in frame.persons]
        return replace(frame, persons=tuple(persons))

    return each(sources, move)


def peopled(to: Callable[[Person, Window], Sequence[Person]], *sources: str) -> Change:
    """Every person of a camera's frames changed into another, several or none."""

    def swap(frame: Frame, window: Window) -> Packet:
        return replace(frame, persons=tuple(p for one in frame.persons for p in to(one, window)))

    return each(sources, swap)


def often(times: int, *sources: str) -> Change:
    """Each packet so many times, spread until about the next one."""

    def repeat(packet: Any, _window: Window) -> list[Packet]:
        period_s = 1.0 / 30.0 if isinstance(packet, Frame) else 0.01
        return [replace(packet, at_s=packet.at_s + k * period_s / times) for k in range(times)]

    return each(sources, repeat)
