"""Several people before two sensors, for tests of identities."""

import numpy as np
from walking_person import POSES, person_at, seen

NS = 1_000_000_000
RATE = 30


def walker(start, velocity, *, scale=1.0, phase=0.0):
    """A person who walks straight on: their joints in map by time, (15, 3) [m]."""

    def at(time_s):
        body = person_at(time_s + phase, walks=False)
        body = (body - [2.5, 0.0, 0.0]) * scale
        return body + [*(np.asarray(start) + np.asarray(velocity) * time_s), 0.0]

    return at


def frames_of(
    people, duration_s, *, ids=None, there=None, seed=1, noise=0.015, poses=POSES, rate=RATE
):
    """All sensors' frames in the order of time, and who is in each.

    Args:
        people: Functions of time to joints in map.
        duration_s: Of the scene.
        ids: What a sensor calls a person: (sensor, index, time) to a string.
        there: Whether a sensor sees a person: (sensor, index, time).
        seed: Of the noise.
        noise: Standard deviation [m].
        poses: ``T_map_sensor``.
        rate: Frames per second of each sensor.
    """
    rng = np.random.default_rng(seed)
    frames = []
    for k in range(round(duration_s * rate)):
        for index, (sensor, T) in enumerate(poses.items()):
            time_s = (k + 0.4 * index) / rate
            stamp_ns = NS + round(time_s * NS)
            shown = [
                (i, seen(at(time_s), T, sensor, stamp_ns, rng, noise, _id(ids, sensor, i, time_s)))
                for i, at in enumerate(people)
                if there is None or there(sensor, i, time_s)
            ]
            if shown:
                shown = [shown[i] for i in rng.permutation(len(shown))]
                frames.append(([one for _, one in shown], [i for i, _ in shown]))
    return frames


def _id(ids, sensor, index, time_s):
    return str(index + 1) if ids is None else ids(sensor, index, time_s)


def numbers_of(tracker, frames):
    """The numbers that a tracker gives each person, in the order in which they come."""
    who = {id(one): i for persons, truth in frames for one, i in zip(persons, truth, strict=True)}
    given = {}
    for persons, _ in frames:
        for number, one in tracker.add(persons):
            numbers = given.setdefault(who[id(one)], [])
            if number not in numbers[-1:]:
                numbers.append(number)
    return given
