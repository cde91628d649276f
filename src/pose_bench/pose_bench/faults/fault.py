"""Definition of a fault, and functions to compose faults."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pose_bench.faults.packets import Frame, FramePerson, Imu, Note, Packet
from pose_core.stamps import NS_PER_S

FAULT_S = 4.0  # [s] duration of a fault
CAMERAS = ("left", "right")


@dataclass(frozen=True)
class Window:
    """Time window of a fault [s] after the session's start, and its random generator."""

    begin_s: float
    end_s: float
    rng: np.random.Generator

    def __contains__(self, packet: object) -> bool:
        return isinstance(packet, Packet) and self.begin_s <= packet.at_s < self.end_s


Change = Callable[[list[Packet], Window], list[Packet]]
"""Function from the session's packets to the published ones."""


@dataclass(frozen=True)
class Signal:
    """Action on a process of the graph.

    Attributes:
        what: ``kill``, ``pause`` or ``resume``.
        node: Executable of :mod:`pose_fusion`.
        after_s: Time after the fault's start [s].
    """

    what: str
    node: str
    after_s: float = 0.0


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        name: Name in the table, and for ``--only``.
        change: Change of the packets; None if it acts on processes only.
        lost: Sources that cannot be used during the fault: ``left``, ``right``,
            ``imu/<segment>``, ``imus`` for all.
        said: Words, one of which a warning in ``/diagnostics`` must contain; empty if no warning
            is required.
        signals: Signals to processes.
        lasts_s: Duration [s].
        silent: Whether the pose is unobservable, so that no output is accepted.
    """

    name: str
    change: Change | None = None
    lost: tuple[str, ...] = ()
    said: tuple[str, ...] = ()
    signals: tuple[Signal, ...] = ()
    lasts_s: float = FAULT_S
    silent: bool = False


def each(sources: Sequence[str], to: Callable[[Any, Window], Packet | Sequence[Packet]]) -> Change:
    """Replace every packet of some sources (``imus``: of all IMUs) by another, several or none."""

    def change(packets: list[Packet], window: Window) -> list[Packet]:
        result: list[Packet] = []
        for packet in packets:
            is_of = packet.source in sources or (isinstance(packet, Imu) and "imus" in sources)
            changed = to(packet, window) if is_of and packet in window else packet
            result += [changed] if isinstance(changed, Packet) else changed
        return sorted(result, key=lambda one: one.at_s)

    return change


def put(**fields: Any) -> Callable[[Any, Window], Packet]:
    """Set some fields of a packet."""
    return lambda packet, _window: replace(packet, **fields)


def silent(*sources: str) -> Change:
    """Remove all packets of these sources."""
    return each(sources, lambda _packet, _window: ())


def stamped(to: Callable[[Any, Window], float], *sources: str) -> Change:
    """Shift the stamps by a time [s]."""

    def move(packet: Any, window: Window) -> Packet:
        return replace(packet, stamp_ns=packet.stamp_ns + round(to(packet, window) * NS_PER_S))

    return each(sources, move)


def placed(to: Callable[[np.ndarray, Window], np.ndarray], *sources: str) -> Change:
    """Change the positions of all persons in a camera's frames, (n, 3) to (n, 3) [m]."""

    def move(frame: Frame, window: Window) -> Packet:
        persons = [replace(one, positions=to(one.positions, window)) for one in frame.persons]
        return replace(frame, persons=tuple(persons))

    return each(sources, move)


def peopled(to: Callable[[FramePerson, Window], Sequence[FramePerson]], *sources: str) -> Change:
    """Replace every person in a camera's frames by another, several or none."""

    def swap(frame: Frame, window: Window) -> Packet:
        return replace(frame, persons=tuple(p for one in frame.persons for p in to(one, window)))

    return each(sources, swap)


def often(times: int, *sources: str) -> Change:
    """Repeat each packet, distributed until the next one."""

    def repeat(packet: Any, _window: Window) -> list[Packet]:
        period_s = 1.0 / 30.0 if isinstance(packet, Frame) else 0.01
        return [replace(packet, at_s=packet.at_s + k * period_s / times) for k in range(times)]

    return each(sources, repeat)


def frozen(*fields: str) -> Callable[[Any, Window], Packet]:
    """Repeat a source's first values of some fields during the fault."""
    firsts: dict[tuple[float, str], Packet] = {}

    def repeat(packet: Any, window: Window) -> Packet:
        first = firsts.setdefault((window.begin_s, packet.source), packet)
        return replace(packet, **{name: getattr(first, name) for name in fields})

    return repeat


def noise(size: int) -> Callable[[Any, Window], Packet]:
    """Random bytes instead of the message."""
    return lambda packet, window: replace(packet, raw=window.rng.bytes(size))


def noted(kind: str, /, **values: Any) -> Change:
    """Add a message of another kind at the fault's start."""

    def add(packets: list[Packet], window: Window) -> list[Packet]:
        first = next(packet for packet in packets if packet in window)
        note = Note(at_s=window.begin_s, source=kind, stamp_ns=first.stamp_ns, values=values)
        return sorted([*packets, note], key=lambda one: one.at_s)

    return add
