"""A recording of serialised messages that is repeated with stamps that go on."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from pose_bench.faults.messages import Planned, planned
from pose_bench.faults.packets import Frame, Packet, packets_of
from pose_bench.repeated_messages import LOOP_NS, VISITOR
from pose_core.api import inverse, transformed
from pose_core.arrays import FloatArray
from pose_core.stamps import NS_PER_S
from pose_sim.captured.session import CapturedSession

STEP_NS = NS_PER_S // 100  # [ns] between the calls of a live node's timers
VISIT_S = (20.0, 45.0)  # [s] of a loop in which a visitor is in view
VISITOR_SIZE = 0.85  # [-] of the subject's
LIGHT_IMUS = ("imu/torso", "imu/right_thigh")  # in a light recording
VISITOR_AT_M = np.array([0.0, 1.6, 0.0])  # [m] in map, from the subject


Steps = Sequence[Sequence[tuple[str, bytes]]]
"""Source (``left``, ``imu/<segment>``) and bytes of the messages that arrive in each step of
:data:`STEP_NS` of a loop that starts at ``START_NS``."""


def steps_of(session: CapturedSession, is_light: bool) -> tuple[Steps, Steps]:
    """The messages of a session of one person, and the same with a visitor.

    Args:
        session: A captured person before two cameras, with IMUs.
        is_light: Whether to take only every third frame, and a quarter of the samples of two IMUs.
    """
    packets = packets_of(session)
    if is_light:
        packets = list(_thinned(packets))
    alone = [planned(packet) for packet in packets]
    visits = {index: planned(frame) for index, frame in _visits(packets, session)}
    visited = [visits.get(index, message) for index, message in enumerate(alone)]
    sources = [packet.source for packet in packets]
    return _in_steps(sources, alone), _in_steps(sources, visited)


def _thinned(packets: Iterable[Packet]) -> Iterator[Packet]:
    """Every third frame of each camera, and two IMUs' samples of every fourth step."""
    frames: Counter[str] = Counter()
    for packet in packets:
        if isinstance(packet, Frame):
            frames[packet.source] += 1
            if frames[packet.source] % 3 == 1:
                yield packet
        elif packet.source in LIGHT_IMUS and round(packet.at_s * NS_PER_S) // STEP_NS % 4 == 1:
            yield packet


def _in_steps(sources: Sequence[str], messages: Sequence[Planned]) -> Steps:
    steps: list[list[tuple[str, bytes]]] = [[] for _ in range(LOOP_NS // STEP_NS)]
    for source, (at_s, _, _, data) in zip(sources, messages, strict=True):
        steps[round(at_s * NS_PER_S) // STEP_NS].append((source, data))
    return steps


def _visits(packets: Sequence[Packet], session: CapturedSession) -> Iterator[tuple[int, Frame]]:
    """The frames with a visitor, who moves as the subject did two seconds before."""
    before: dict[str, list[FloatArray]] = {sensor: [] for sensor in session.T_map_sensor}
    for index, packet in enumerate(packets):
        if not isinstance(packet, Frame):
            continue
        (person,) = packet.persons
        past = before[packet.source]
        past.append(person.positions)
        if VISIT_S[0] <= packet.at_s < VISIT_S[1]:
            T_map_sensor = session.T_map_sensor[packet.source]
            in_map = transformed(T_map_sensor, past[-60]) * VISITOR_SIZE + VISITOR_AT_M
            positions = transformed(inverse(T_map_sensor), in_map)
            visitor = replace(person, id=VISITOR.decode(), positions=positions)
            yield index, replace(packet, persons=(person, visitor))
