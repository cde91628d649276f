"""Base of all live sources: conversion of persons to frames, and counters of rejected data."""

import threading
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from kinect_bridge.source import SkeletonFrame, SkeletonSource
from kinect_bridge.sources.live_clock import CLOCK_COUNTERS, LiveClock
from pose_core.arrays import FloatArray
from pose_core.counters import Counters
from pose_core.joints import JOINTS, TrackingState
from pose_core.stamps import NS_PER_S
from pose_io.recordings.joint_maps import JointMap, mark_missing
from pose_node.node_status import Level, Report

MAX_PEOPLE = 16  # per frame
MAX_ID = 32  # [characters]
MAX_DISTANCE_M = 100.0  # [m] joints farther away are rejected
QUEUE = 64  # largest number of frames waiting for the node
SILENCE_NS = 2 * NS_PER_S  # [ns] time without frames after which there is a warning

FRAME_COUNTERS = (
    "frames_received",
    "frames_overrun",  # left out: the node was too slow
    "people_beyond_limit",  # left out: more than MAX_PEOPLE in a frame
    "people_repeated",  # left out: an id twice in a frame
    "people_bad_id",  # left out: an id that is not valid in a topic
    "people_wrong_joints",  # left out: another number of joints than the map's
    "people_without_joints",  # left out: not one joint tracked
    "joints_out_of_range",  # not tracked: further away than MAX_DISTANCE_M
)


@dataclass(frozen=True, kw_only=True)
class Person:
    """One person of a source; n joints in the order of its joint map."""

    id: str
    positions: FloatArray  # (n, 3) in the source's axes and unit; NaN where missing
    confidence: FloatArray | None = None  # (n,) in the source's scale; None without confidences
    at_most: TrackingState = TrackingState.TRACKED  # upper bound of all joints' states


class LiveSource(SkeletonSource):
    """Base of live sources; a subclass calls :meth:`push` from one thread.

    Args:
        hardware_id: The device, port or topic.
        joint_map: Joint map of the persons.
        on_host_clock: See :class:`LiveClock`.

    Attributes:
        NAME: The source's name, for messages.
        COUNTERS: Further counters of the subclass, by reason.
    """

    NAME: ClassVar[str]
    COUNTERS: ClassVar[tuple[str, ...]]

    def __init__(self, hardware_id: str, joint_map: JointMap, *, on_host_clock: bool) -> None:
        self.hardware_id = hardware_id
        self.joint_map = joint_map
        self.counters = Counters(*FRAME_COUNTERS, *CLOCK_COUNTERS, *self.COUNTERS)
        self._clock = LiveClock(self.counters, on_host_clock=on_host_clock)
        self._frames: deque[SkeletonFrame] = deque()
        self._now_ns: Callable[[], int] = lambda: 0
        self._wake: Callable[[], None] = lambda: None
        self._heard_ns: int | None = None

    def start(self, now_ns: Callable[[], int], wake: Callable[[], None]) -> None:
        """Start; see :class:`SkeletonSource`."""
        self._now_ns, self._wake = now_ns, wake

    def take(self) -> SkeletonFrame | None:
        """Remove and return the oldest frame of the queue; None if it is empty."""
        return self._frames.popleft() if self._frames else None

    def no_places(self) -> FloatArray:
        """Positions of the joint map's n joints, (n, 3), all of them missing."""
        return np.full((len(self.joint_map.joints), 3), np.nan)

    def push(self, people: Sequence[Person], capture_ns: int | None) -> None:
        """Queue a frame for the node.

        Args:
            people: All persons in the frame.
            capture_ns: Capture time [ns], None if unknown.
        """
        arrival_ns = self._now_ns()
        self._heard_ns = arrival_ns
        self.counters.add("frames_received")
        stamp_ns = self._clock.stamp(capture_ns, arrival_ns)
        if stamp_ns is None:
            return
        if len(self._frames) == QUEUE:
            self.counters.add("frames_overrun")
            self._frames.popleft()
        self._frames.append(self._frame(people, stamp_ns))
        self._wake()

    def report(self) -> Report:
        """Whether frames arrive, and all counters."""
        values = {
            **self.counters.as_dict(),
            "joint_map": self.joint_map.sensor,
            "delay_ms": f"{self._clock.delay_ns * 1e-6:.1f}",
            "clock_drift_ppm": f"{self._clock.drift * 1e6:.1f}",
            **self.details(),
        }
        silent_ns = 0 if self._heard_ns is None else self._now_ns() - self._heard_ns
        level, message = Level.OK, f"receiving from {self.NAME}"
        if self._heard_ns is None:
            level, message = Level.WARN, f"waiting for {self.waits_for()}"
        elif silent_ns > SILENCE_NS:
            level = Level.WARN
            message = f"nothing from {self.waits_for()} for {silent_ns / NS_PER_S:.0f} s"
        return Report(level=level, message=message, values=values)

    def waits_for(self) -> str:
        """Description of what the source waits for."""
        return f"{self.NAME} on {self.hardware_id}"

    def details(self) -> Mapping[str, object]:
        """Further values for ``/diagnostics``."""
        return {}

    def _frame(self, people: Sequence[Person], stamp_ns: int) -> SkeletonFrame:
        ids, positions, states = [], [], []
        for person in self._acceptable(people):
            state = np.minimum(self.joint_map.states(person.confidence), np.uint8(person.at_most))
            given = np.asarray(person.positions, np.float64)
            place, state = self.joint_map.convert(
                np.where(np.isfinite(given), given, np.nan), state
            )
            far = np.abs(place).max(axis=-1) > MAX_DISTANCE_M  # False for NaN
            self.counters.add("joints_out_of_range", int(far.sum()))
            place[far] = np.nan
            mark_missing(place, state)
            if not state.any():
                self.counters.add("people_without_joints")
                continue
            ids.append(person.id)
            positions.append(place)
            states.append(state)
        return SkeletonFrame(
            stamp_ns=stamp_ns,
            person=tuple(ids),
            positions=np.array(positions).reshape(-1, len(JOINTS), 3),
            tracking_state=np.array(states, dtype=np.uint8).reshape(-1, len(JOINTS)),
        )

    def _acceptable(self, people: Sequence[Person]) -> list[Person]:
        """The persons with a valid id and number of joints."""
        self.counters.add("people_beyond_limit", max(0, len(people) - MAX_PEOPLE))
        accepted: dict[str, Person] = {}
        for person in people[:MAX_PEOPLE]:
            if not is_name(person.id):
                self.counters.add("people_bad_id")
            elif person.id in accepted:
                self.counters.add("people_repeated")
            elif np.shape(person.positions) != (len(self.joint_map.joints), 3):
                self.counters.add("people_wrong_joints")
            else:
                accepted[person.id] = person
        return list(accepted.values())


class ThreadedSource(LiveSource):
    """Base of the sources that read in a thread of their own, with another clock than the host's.

    Args:
        hardware_id: The device or port.
        joint_map: Joint map of the persons.
    """

    def __init__(self, hardware_id: str, joint_map: JointMap) -> None:
        super().__init__(hardware_id, joint_map, on_host_clock=False)
        self._ends = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, now_ns: Callable[[], int], wake: Callable[[], None]) -> None:
        """Start the thread."""
        super().start(now_ns, wake)
        self._thread = threading.Thread(target=self._run, name=self.NAME, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._ends.set()
        if self._thread is not None:
            self._thread.join()

    @abstractmethod
    def _run(self) -> None:
        """Read until ``_ends`` is set."""


def is_name(text: str) -> bool:
    """Whether an id is valid in topics: at most MAX_ID letters, digits and underscores."""
    return len(text) <= MAX_ID and text.isascii() and text.replace("_", "a").isalnum()
