"""Scenes with more sensors or people than usual, for the live graph."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pose_bench.captured import truth_of
from pose_bench.faults.judging import Poses, rmse_deg
from pose_bench.faults.packets import Packet, packet_of, packets_of
from pose_bench.replayed_person import SESSION_S, captured_person
from pose_core.api import SEGMENTS, SkeletonSeries
from pose_core.arrays import FloatArray
from pose_sim.captured.clips import bundled_clips
from pose_sim.captured.crowd import CrowdSpec, make_crowd
from pose_sim.captured.session import START_NS, make_captured_session

PEOPLE = 6
OTHER_NAMES = {"left": "back", "right": "side"}  # of the third and fourth camera


@dataclass(frozen=True, kw_only=True)
class LoadScene:
    """Packets of a scene from ``START_NS`` on."""

    name: str
    T_map_sensor: Mapping[str, FloatArray]  # (4, 4)
    packets: Sequence[Packet]
    max_people: int = 1
    truth: SkeletonSeries | None = None  # of the subject

    def rmse_deg(self, bodies: Poses, begin_ns: int) -> float:
        """RMSE of the subject's twelve angles [deg] in a replay from ``begin_ns``; or NaN."""
        if self.truth is None:
            return float("nan")
        shifted = self.truth.stamps_ns - START_NS + begin_ns
        return rmse_deg(bodies, replace(self.truth, stamps_ns=shifted))


def usual() -> LoadScene:
    """One person, two cameras, nine IMUs."""
    person = captured_person()
    return LoadScene(
        name="two cameras, nine IMUs",
        T_map_sensor=person.T_map_sensor,
        packets=packets_of(person),
        truth=truth_of(person, START_NS),
    )


def many_sensors() -> LoadScene:
    """One person, four cameras, an IMU on each of the 15 segments."""
    person = captured_person()
    first = make_captured_session(replace(person.spec, worn=SEGMENTS))
    second = make_captured_session(replace(person.spec, seed=person.spec.seed + 1, worn=()))
    others = [replace(each, source=OTHER_NAMES[each.source]) for each in packets_of(second)]
    places = {OTHER_NAMES[name]: place for name, place in second.T_map_sensor.items()}
    packets = sorted([*packets_of(first), *others], key=lambda packet: packet.at_s)
    return LoadScene(
        name="four cameras, 15 IMUs",
        T_map_sensor={**first.T_map_sensor, **places},
        packets=packets,
        truth=truth_of(person, START_NS),
    )


def many_people() -> LoadScene:
    """Six people before two cameras, who cross each other; all are estimated."""
    clips = tuple(bundled_clips()[:PEOPLE])
    crowd = make_crowd(CrowdSpec(clips=clips, seed=1, duration_s=SESSION_S, leaves=False))
    return LoadScene(
        name="six people, two cameras",
        T_map_sensor=crowd.T_map_sensor,
        packets=[packet_of(*frame.persons) for frame in crowd.frames],
        max_people=PEOPLE,
    )


SCENES = {"usual": usual, "sensors": many_sensors, "people": many_people}
