"""Faults of cameras and trackers: silence, units, names, other people, invalid data."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_bench.faults.fault import (
    CAMERAS,
    Fault,
    Window,
    each,
    often,
    peopled,
    placed,
    silent,
)
from pose_bench.faults.packets import Frame, Note, Packet, Person
from pose_core.joints import JOINTS

R, L, B = ("right",), ("left",), CAMERAS
MIRRORED = tuple(
    n.replace("left", "*").replace("right", "left").replace("*", "right") for n in JOINTS
)


def _all(value: float) -> Callable[[np.ndarray, Window], np.ndarray]:
    return lambda positions, _window: np.full_like(positions, value)


def _named(*names: str) -> Callable[[Person, Window], Sequence[Person]]:
    return lambda person, _window: [replace(person, names=names)]


def _some(count: int) -> Callable[[Person, Window], Sequence[Person]]:
    """A message with ``count`` joints."""

    def cut(person: Person, _window: Window) -> Sequence[Person]:
        index = np.arange(count) % len(JOINTS)
        names = tuple(JOINTS[i] if k < len(JOINTS) else f"extra_{k}" for k, i in enumerate(index))
        positions, states = person.positions[index], person.states[index]
        return [replace(person, names=names, positions=positions, states=states)]

    return cut


def _strangers(count: int) -> Callable[[Person, Window], Sequence[Person]]:
    """Other people beside and before the person."""

    def crowd(person: Person, window: Window) -> Sequence[Person]:
        away = [
            replace(
                person, id=f"s{k}", positions=person.positions + window.rng.uniform(1.0, 4.0, 3)
            )
            for k in range(count)
        ]
        return [*away, person]

    return crowd


def _joint(value: float) -> Callable[[np.ndarray, Window], np.ndarray]:
    def set_one(positions: np.ndarray, window: Window) -> np.ndarray:
        changed = positions.copy()
        changed[window.rng.integers(len(JOINTS))] = value
        return changed

    return set_one


def _tilted(degrees: float) -> Callable[[np.ndarray, Window], np.ndarray]:
    return lambda positions, _: Rotation.from_euler("y", degrees, degrees=True).apply(positions)


class _Frozen:
    """A camera that repeats its last frame with new stamps."""

    def __init__(self) -> None:
        self._last: dict[tuple[float, str], tuple[Person, ...]] = {}

    def __call__(self, frame: Frame, window: Window) -> Packet:
        persons = self._last.setdefault((window.begin_s, frame.source), frame.persons)
        return replace(frame, persons=persons)


def _flips(count: int) -> Callable[[Any, Window], Packet]:
    def flip(packet: Any, window: Window) -> Packet:
        places = tuple(window.rng.integers(0, 1 << 20, count).tolist())
        return replace(packet, flips=places)

    return flip


def _noise(size: int) -> Callable[[Any, Window], Packet]:
    return lambda packet, window: replace(packet, raw=window.rng.bytes(size))


def _lying(packet: Any, _window: Window) -> Packet:
    """A string length of 4 GB at the frame's name."""
    return replace(packet, raw=b"\0\1\0\0" + b"\0" * 8 + b"\xff" * 4 + b"x" * 400)


def _tf(**values: Any) -> Callable[[list[Packet], Window], list[Packet]]:
    def add(packets: list[Packet], window: Window) -> list[Packet]:
        first = next(packet for packet in packets if packet in window)
        note = Note(at_s=window.begin_s, source="tf_static", stamp_ns=first.stamp_ns, values=values)
        return sorted([*packets, note], key=lambda one: one.at_s)

    return add


def _slow(packet: Frame, window: Window) -> Sequence[Packet]:
    return [packet] if int(packet.at_s * 30.0) % 6 == 0 else []


FAULTS = (
    Fault(name="right: silent", change=silent(*R), lost=R, said=R),
    Fault(name="left: silent", change=silent(*L), lost=L, said=L),
    Fault(name="both: silent", change=silent(*B), lost=B, said=B),
    Fault(
        name="everything silent", change=silent(*B, "imus"), lost=(*B, "imus"), said=B, silent=True
    ),
    Fault(name="right: five frames a second", change=each(R, _slow)),
    Fault(name="right: frozen picture", change=each(R, _Frozen()), lost=R, said=R),
    Fault(name="both: frozen picture", change=each(B, _Frozen()), lost=B, said=B),
    Fault(name="right: NaN", change=placed(_all(np.nan), *R), lost=R, said=R),
    Fault(name="both: NaN", change=placed(_all(np.nan), *B), lost=B, said=B),
    Fault(name="right: infinities", change=placed(_all(np.inf), *R), lost=R, said=R),
    Fault(name="right: zeros", change=placed(_all(0.0), *R), lost=R, said=R),
    Fault(name="right: 1e300", change=placed(_all(1e300), *R), lost=R, said=R),
    Fault(name="right: one joint 1e30", change=placed(_joint(1e30), *R)),
    Fault(name="right: one joint anywhere", change=placed(_joint(1.0), *R)),
    Fault(name="right: millimetres", change=placed(lambda p, _: 1000.0 * p, *R), lost=R, said=R),
    Fault(name="right: feet", change=placed(lambda p, _: 3.2808 * p, *R), lost=R, said=R),
    Fault(name="right: bumped by 10 degrees", change=placed(_tilted(10.0), *R), lost=R),
    Fault(
        name="right: upside down",
        change=placed(lambda p, _: p * [1.0, -1.0, 1.0], *R),
        lost=R,
        said=R,
    ),
    Fault(
        name="right: noise of 0.3 m",
        change=placed(lambda p, w: p + 0.3 * w.rng.standard_normal(p.shape), *R),
        lost=R,
    ),
    Fault(
        name="right: wrong names",
        change=peopled(_named(*(f"j{k}" for k in range(15))), *R),
        lost=R,
        said=R,
    ),
    Fault(
        name="right: one name for all", change=peopled(_named(*["head"] * 15), *R), lost=R, said=R
    ),
    Fault(name="right: mirrored names", change=peopled(_named(*MIRRORED), *R), lost=R),
    Fault(name="right: five joints", change=peopled(_some(5), *R), lost=R),
    Fault(name="right: 200 joints", change=peopled(_some(200), *R)),
    Fault(
        name="right: more names than joints",
        change=peopled(lambda p, _: [replace(p, names=(*p.names, "more"))], *R),
        lost=R,
        said=R,
    ),
    Fault(
        name="right: tracking state 255",
        change=peopled(lambda p, _: [replace(p, states=np.full(15, 255, np.uint8))], *R),
        lost=R,
        said=R,
    ),
    Fault(name="right: unknown frame", change=each(R, lambda f, _: replace(f, frame_id="moon"))),
    Fault(name="right: nobody", change=peopled(lambda _p, _w: [], *R), lost=R),
    Fault(name="both: 20 strangers", change=peopled(_strangers(20), *B)),
    Fault(name="both: 100 strangers", change=peopled(_strangers(100), *B)),
    Fault(
        name="right: a new id in every frame",
        change=peopled(lambda p, w: [replace(p, id=str(w.rng.integers(1 << 40)))], *R),
    ),
    Fault(name="right: bit flips", change=each(R, _flips(3)), lost=R),
    Fault(name="right: garbage", change=each(R, _noise(300)), lost=R, said=R),
    Fault(name="right: 1 MB/s of noise", change=each(R, _noise(33_000)), lost=R, said=R),
    Fault(name="right: lengths that lie", change=each(R, _lying), lost=R, said=R),
    Fault(
        name="right: cut messages", change=each(R, lambda p, _: replace(p, cut=90)), lost=R, said=R
    ),
    Fault(
        name="right: empty messages", change=each(R, lambda p, _: replace(p, cut=4)), lost=R, said=R
    ),
    Fault(name="both: garbage", change=each(B, _noise(300)), lost=B, said=B),
    Fault(name="both: four times the rate", change=often(4, *B)),
    Fault(name="tf_static: 1e300", change=_tf(size=1e300), said=("transform", "tf_static")),
    Fault(name="tf_static: NaN", change=_tf(size=float("nan")), said=("transform", "tf_static")),
    Fault(name="tf_static: unknown frames", change=_tf(size=1.0, frames=("moon", "mars"))),
    Fault(name="tf_static: garbage", change=_tf(raw=True)),
)
"""Faults of cameras."""
