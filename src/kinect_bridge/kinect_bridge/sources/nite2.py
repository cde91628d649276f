"""``nite2``: NiTE2's skeletons of a Kinect v1, Xtion or Orbbec Astra, through its C interface.

One thread opens the sensor and waits for frames; if there is none for two seconds, it closes and
reopens the sensor, which may have been unplugged.
"""

import ctypes
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from typing import Any

import numpy as np

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.live import LiveSource, Person
from kinect_bridge.sources.nite2_library import (
    FRAME_READY,
    JOINT_COUNT,
    MAX_USERS,
    Callbacks,
    LibraryError,
    Nite2Library,
)
from pose_core.errors import ParameterError
from pose_io.recordings.joint_map_files import find_joint_map

NS_PER_US = 1000
SILENCE_S = 2.0  # [s] without a frame after which the sensor is lost
RETRY_S = 1.0  # [s] between attempts to open it
LOST = 4  # NiteUserState, a bit
NONE, TRACKED = 0, 2  # NiteSkeletonState
COUNTERS = ("sensor_opened", "sensor_lost", "users_not_tracked", "users_beyond_limit")


class Nite2Source(LiveSource):
    """Source of NiTE2's users.

    Raises:
        PoseError: If a library or the joint map cannot be used.
    """

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        self._device = parameters.nite2_device
        self._library = Nite2Library(parameters.nite2_library)
        joint_map = find_joint_map(parameters.joint_map or "nite2")
        if len(joint_map.joints) != JOINT_COUNT:
            raise ParameterError(
                f"joint_map = '{parameters.joint_map}' has {len(joint_map.joints)} joints, NiTE2 "
                f"{JOINT_COUNT}: give another map, or none"
            )
        super().__init__(
            "nite2",
            self._device or "any OpenNI2 sensor",
            joint_map,
            on_host_clock=False,
            counters=COUNTERS,
        )
        self._ends = threading.Event()
        self._ready = threading.Event()
        # References are kept while the library may call them.
        self._callbacks = Callbacks(FRAME_READY(lambda _: self._ready.set()))
        self._thread: threading.Thread | None = None
        self._trouble = "the sensor has not been opened yet"

    def start(self, now_ns: Callable[[], int], wake: Callable[[], None]) -> None:
        """Open the sensor and read it, in a thread."""
        super().start(now_ns, wake)
        self._thread = threading.Thread(target=self._run, name="nite2", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Release the sensor."""
        self._ends.set()
        self._ready.set()
        if self._thread is not None:
            self._thread.join()

    def details(self) -> Mapping[str, object]:
        """Error messages of the libraries."""
        return {"trouble": self._trouble}

    def _run(self) -> None:
        while not self._ends.is_set():
            try:
                self._use_sensor()
            except LibraryError as error:
                self._trouble = str(error)
            self._ends.wait(RETRY_S)

    def _use_sensor(self) -> None:
        """Read the sensor until the source is closed, or an error."""
        with ExitStack() as opened:
            self._library.initialize()
            opened.callback(self._library.shutdown)
            device = self._open_device()
            if device is not None:
                opened.callback(self._library.close_device, device)
            tracker = self._library.create_tracker(device)
            opened.callback(self._library.destroy_tracker, tracker)
            self._read(tracker)

    def _open_device(self) -> ctypes.c_void_p | None:
        """Open the selected sensor; None if any: NiTE2 opens it itself."""
        if not self._device:
            return None
        uris = self._library.devices()
        number = int(self._device) if self._device.isdecimal() else -1
        if number >= len(uris):
            raise LibraryError(
                f"{len(uris)} sensors are plugged in: no sensor with the index {number}"
            )
        return self._library.open_device(uris[number] if number >= 0 else self._device)

    def _read(self, tracker: ctypes.c_void_p) -> None:
        """Read frames until the source is closed or frames stop."""
        self._ready.clear()
        self._library.register(tracker, self._callbacks)
        try:
            while self._ready.wait(SILENCE_S) and not self._ends.is_set():
                self._ready.clear()
                if self._trouble:
                    self.counters.add("sensor_opened")
                    self._trouble = ""
                self._read_frame(tracker)
        finally:
            self._library.unregister(tracker, self._callbacks)
        if not self._ends.is_set():
            self.counters.add("sensor_lost", not self._trouble)
            raise LibraryError(f"no frame for {SILENCE_S:g} s: is the sensor plugged in?")

    def _read_frame(self, tracker: ctypes.c_void_p) -> None:
        frame = self._library.read_frame(tracker)
        try:
            count = frame.contents.user_count
            self.counters.add("users_beyond_limit", max(0, count - MAX_USERS))
            people = []
            for number in range(min(count, MAX_USERS)):
                user = frame.contents.users[number]
                if user.skeleton_state == TRACKED and not user.state & LOST:
                    people.append(_person(user))
                    continue
                self.counters.add("users_not_tracked")
                if user.skeleton_state == NONE and not user.state & LOST:
                    with suppress(LibraryError):  # the person has left
                        self._library.start_skeleton(tracker, user.id)
            capture_ns = frame.contents.timestamp_us * NS_PER_US
        finally:
            self._library.release_frame(tracker, frame)
        self.push(people, capture_ns)


def _person(user: Any) -> Person:
    """A user's joints, by their type."""
    positions = np.full((JOINT_COUNT, 3), np.nan)
    confidence = np.zeros(JOINT_COUNT)
    for joint in user.joints:
        if 0 <= joint.joint_type < JOINT_COUNT:
            place = joint.position
            positions[joint.joint_type] = place.x, place.y, place.z
            confidence[joint.joint_type] = joint.position_confidence
    return Person(id=str(user.id), positions=positions, confidence=confidence)
