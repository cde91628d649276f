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
    frozen,
    noise,
    noted,
    often,
    peopled,
    placed,
    put,
    silent,
)
from pose_bench.faults.packets import Frame, FramePerson, Packet
from pose_core.joints import JOINTS, OTHER_SIDE

R, L, B = ("right",), ("left",), CAMERAS
TILT = Rotation.from_euler("y", 10.0, degrees=True)
LYING = b"\0\1\0\0" + b"\0" * 8 + b"\xff" * 4 + b"x" * 400  # the frame's name: 4 GB
MIRRORED = tuple(JOINTS[other] for other in OTHER_SIDE)


def _all(value: float) -> Callable[[np.ndarray, Window], np.ndarray]:
    return lambda positions, _window: np.full_like(positions, value)


def _named(*names: str) -> Callable[[FramePerson, Window], Sequence[FramePerson]]:
    return lambda person, _window: [replace(person, names=names)]


def _some(count: int) -> Callable[[FramePerson, Window], Sequence[FramePerson]]:
    """A message with ``count`` joints."""

    def cut(person: FramePerson, _window: Window) -> Sequence[FramePerson]:
        index = np.arange(count) % len(JOINTS)
        names = tuple(JOINTS[i] if k < len(JOINTS) else f"extra_{k}" for k, i in enumerate(index))
        positions, states = person.positions[index], person.states[index]
        return [replace(person, names=names, positions=positions, states=states)]

    return cut


def _strangers(count: int) -> Callable[[FramePerson, Window], Sequence[FramePerson]]:
    """Other people beside and before the person."""

    def crowd(person: FramePerson, window: Window) -> Sequence[FramePerson]:
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


def _flipped(packet: Any, window: Window) -> Packet:
    return replace(packet, flips=tuple(window.rng.integers(0, 1 << 20, 3).tolist()))


def _slow(packet: Frame, window: Window) -> Sequence[Packet]:
    return [packet] if int(packet.at_s * 30.0) % 6 == 0 else []


FAULTS = (
    Fault("right: silent", silent(*R), R, R),
    Fault("left: silent", silent(*L), L, L),
    Fault("both: silent", silent(*B), B, B),
    Fault("everything silent", silent(*B, "imus"), (*B, "imus"), B, silent=True),
    Fault("right: five frames a second", each(R, _slow)),
    Fault("right: frozen picture", each(R, frozen("persons")), R, R),
    Fault("both: frozen picture", each(B, frozen("persons")), B, B),
    Fault("right: NaN", placed(_all(np.nan), *R), R, R),
    Fault("both: NaN", placed(_all(np.nan), *B), B, B),
    Fault("right: infinities", placed(_all(np.inf), *R), R, R),
    Fault("right: zeros", placed(_all(0.0), *R), R, R),
    Fault("right: 1e300", placed(_all(1e300), *R), R, R),
    Fault("right: one joint 1e30", placed(_joint(1e30), *R)),
    Fault("right: one joint anywhere", placed(_joint(1.0), *R)),
    Fault("right: millimetres", placed(lambda p, _: 1000.0 * p, *R), R, R),
    Fault("right: feet", placed(lambda p, _: 3.2808 * p, *R), R, R),
    Fault("right: bumped by 10 degrees", placed(lambda p, _: TILT.apply(p), *R), R),
    Fault("right: upside down", placed(lambda p, _: p * [1.0, -1.0, 1.0], *R), R, R),
    Fault(
        "right: noise of 0.3 m",
        placed(lambda p, w: p + 0.3 * w.rng.standard_normal(p.shape), *R),
        R,
    ),
    Fault("right: wrong names", peopled(_named(*(f"j{k}" for k in range(15))), *R), R, R),
    Fault("right: one name for all", peopled(_named(*["head"] * 15), *R), R, R),
    Fault("right: mirrored names", peopled(_named(*MIRRORED), *R), R),
    Fault("right: five joints", peopled(_some(5), *R), R),
    Fault("right: 200 joints", peopled(_some(200), *R)),
    Fault(
        "right: more names than joints",
        peopled(lambda p, _: [replace(p, names=(*p.names, "more"))], *R),
        R,
        R,
    ),
    Fault(
        "right: tracking state 255",
        peopled(lambda p, _: [replace(p, states=np.full(15, 255, np.uint8))], *R),
        R,
        R,
    ),
    Fault("right: unknown frame", each(R, put(frame_id="moon"))),
    Fault("right: nobody", peopled(lambda _p, _w: [], *R), R),
    Fault("both: 20 strangers", peopled(_strangers(20), *B)),
    Fault("both: 100 strangers", peopled(_strangers(100), *B)),
    Fault(
        "right: a new id in every frame",
        peopled(lambda p, w: [replace(p, id=str(w.rng.integers(1 << 40)))], *R),
    ),
    Fault("right: bit flips", each(R, _flipped), R),
    Fault("right: garbage", each(R, noise(300)), R, R),
    Fault("right: 1 MB/s of noise", each(R, noise(33_000)), R, R),
    Fault("right: lengths that lie", each(R, put(raw=LYING)), R, R),
    Fault("right: cut messages", each(R, put(cut=90)), R, R),
    Fault("right: empty messages", each(R, put(cut=4)), R, R),
    Fault("both: garbage", each(B, noise(300)), B, B),
    Fault("both: four times the rate", often(4, *B)),
    Fault("tf_static: 1e300", noted("tf_static", size=1e300), said=("transform", "tf_static")),
    Fault("tf_static: NaN", noted("tf_static", size=float("nan")), said=("transform", "tf_static")),
    Fault("tf_static: unknown frames", noted("tf_static", size=1.0, frames=("moon", "mars"))),
    Fault("tf_static: garbage", noted("tf_static", raw=True)),
)
"""Faults of cameras."""
