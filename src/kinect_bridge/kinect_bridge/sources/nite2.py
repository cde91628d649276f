"""``nite2``: NiTE2's skeletons of a Kinect v1, Xtion or Orbbec Astra, through its C interface.

One thread opens the sensor and waits for frames; if there is none for two seconds, it closes and
reopens the sensor, which may have been unplugged.
"""

import threading
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from ctypes import POINTER, byref, c_void_p
from typing import Any

import numpy as np

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.live import Person, ThreadedSource
from kinect_bridge.sources.nite2_library import (
    FRAME_READY,
    JOINT_COUNT,
    MAX_USERS,
    ONI_API_VERSION,
    Callbacks,
    Device,
    LibraryError,
    Nite2Library,
    TrackerFrame,
)
from pose_core.errors import ParameterError
from pose_core.stamps import NS_PER_US
from pose_io.recordings.joint_map_files import find_joint_map

SILENCE_S = 2.0  # [s] without a frame after which the sensor is lost
RETRY_S = 1.0  # [s] between attempts to open it
LOST = 4  # NiteUserState, a bit
NONE, TRACKED = 0, 2  # NiteSkeletonState


class Nite2Source(ThreadedSource):
    """Source of NiTE2's users.

    Raises:
        PoseError: If a library or the joint map cannot be used.
    """

    NAME = "nite2"
    COUNTERS = ("sensor_opened", "sensor_lost", "users_not_tracked", "users_beyond_limit")

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        self._device = parameters.nite2_device
        self._library = Nite2Library(parameters.nite2_library)
        joint_map = find_joint_map(parameters.joint_map or "nite2")
        if len(joint_map.joints) != JOINT_COUNT:
            raise ParameterError(
                f"joint_map = '{parameters.joint_map}' has {len(joint_map.joints)} joints, NiTE2 "
                f"{JOINT_COUNT}: give another map, or none"
            )
        super().__init__(self._device or "any OpenNI2 sensor", joint_map)
        self._ready = threading.Event()
        # References are kept while the library may call them.
        self._callbacks = Callbacks(FRAME_READY(lambda _: self._ready.set()))
        self._trouble = "the sensor has not been opened yet"

    def close(self) -> None:
        """Release the sensor."""
        self._ends.set()
        self._ready.set()
        super().close()

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
        openni, nite = self._library.openni, self._library.nite
        with ExitStack() as opened:
            openni.oniInitialize(ONI_API_VERSION)
            opened.callback(openni.oniShutdown)
            nite.niteInitialize()
            opened.callback(nite.niteShutdown)
            tracker = c_void_p()
            if self._device:
                device = c_void_p()
                openni.oniDeviceOpen(self._device_uri().encode(), byref(device))
                opened.callback(openni.oniDeviceClose, device)
                wrapped = Device(handle=device)
                nite.niteInitializeUserTrackerByDevice(byref(wrapped), byref(tracker))
            else:
                nite.niteInitializeUserTracker(byref(tracker))  # opens any sensor itself
            opened.callback(nite.niteShutdownUserTracker, tracker)
            self._ready.clear()
            nite.niteRegisterUserTrackerCallbacks(tracker, byref(self._callbacks), None)
            opened.callback(
                nite.niteUnregisterUserTrackerCallbacks, tracker, byref(self._callbacks)
            )
            self._read(tracker)

    def _device_uri(self) -> str:
        """The URI of the selected sensor."""
        if not self._device.isdecimal():
            return self._device
        uris, number = self._library.devices(), int(self._device)
        if number >= len(uris):
            raise LibraryError(
                f"{len(uris)} sensors are plugged in: no sensor with the index {number}"
            )
        return uris[number]

    def _read(self, tracker: c_void_p) -> None:
        """Read frames until the source is closed or frames stop."""
        while self._ready.wait(SILENCE_S) and not self._ends.is_set():
            self._ready.clear()
            if self._trouble:
                self.counters.add("sensor_opened")
                self._trouble = ""
            self._read_frame(tracker)
        if not self._ends.is_set():
            self.counters.add("sensor_lost", not self._trouble)
            raise LibraryError(f"no frame for {SILENCE_S:g} s: is the sensor plugged in?")

    def _read_frame(self, tracker: c_void_p) -> None:
        nite, frame = self._library.nite, POINTER(TrackerFrame)()
        nite.niteReadUserTrackerFrame(tracker, byref(frame))
        if not frame:
            raise LibraryError("niteReadUserTrackerFrame gave no frame")
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
                        nite.niteStartSkeletonTracking(tracker, user.id)
            capture_ns = frame.contents.timestamp_us * NS_PER_US
        finally:
            nite.niteUserTrackerFrameRelease(tracker, frame)
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
