"""Bindings (ctypes) of the C functions of OpenNI2 and NiTE2 for skeletons.

The libraries are installed by the user, in one folder or the system's search path. Layouts are
those of ``OniCTypes.h`` 2.2 and ``NiteCTypes.h`` 2.2.
"""

import ctypes
from ctypes import POINTER, byref, c_char, c_char_p, c_float, c_int, c_short, c_uint64, c_void_p
from pathlib import Path
from typing import Any

from pose_core.errors import InputError, PoseError

JOINT_COUNT = 15
ONI_API_VERSION = 2002  # 1000 * major + minor
OK = 0
MAX_USERS = 64  # largest accepted number in a frame
MAX_DEVICES = 64


class LibraryError(PoseError):
    """A function of the libraries has failed: the sensor is missing or lost."""


class Point(ctypes.Structure):
    """NitePoint3f [mm]."""

    _fields_ = (("x", c_float), ("y", c_float), ("z", c_float))


class Quaternion(ctypes.Structure):
    """NiteQuaternion."""

    _fields_ = (("x", c_float), ("y", c_float), ("z", c_float), ("w", c_float))


class SkeletonJoint(ctypes.Structure):
    """NiteSkeletonJoint."""

    _fields_ = (
        ("joint_type", c_int),
        ("position", Point),
        ("position_confidence", c_float),
        ("orientation", Quaternion),
        ("orientation_confidence", c_float),
    )


class UserData(ctypes.Structure):
    """NiteUserData: one person."""

    _fields_ = (
        ("id", c_short),
        ("bounding_box", Point * 2),
        ("center_of_mass", Point),
        ("state", c_int),
        ("joints", SkeletonJoint * JOINT_COUNT),
        ("skeleton_state", c_int),
        ("poses", (c_int * 2) * 2),
    )


class UserMap(ctypes.Structure):
    """NiteUserMap: the person of each pixel; not used."""

    _fields_ = (("pixels", c_void_p), ("width", c_int), ("height", c_int), ("stride", c_int))


class TrackerFrame(ctypes.Structure):
    """NiteUserTrackerFrame."""

    _fields_ = (
        ("user_count", c_int),
        ("users", POINTER(UserData)),
        ("user_map", UserMap),
        ("depth_frame", c_void_p),
        ("timestamp_us", c_uint64),
        ("frame_index", c_int),
        ("floor_confidence", c_float),
        ("floor", Point * 2),
    )


class DeviceInfo(ctypes.Structure):
    """OniDeviceInfo."""

    _fields_ = (
        ("uri", c_char * 256),
        ("vendor", c_char * 256),
        ("name", c_char * 256),
        ("usb_vendor_id", ctypes.c_ushort),
        ("usb_product_id", ctypes.c_ushort),
    )


class Device(ctypes.Structure):
    """The part of the C++ class ``openni::Device`` that NiTE2 reads: the handle at its offset."""

    _fields_ = (("playback_control", c_void_p), ("handle", c_void_p), ("rest", c_char * 4096))


FRAME_READY = ctypes.CFUNCTYPE(None, c_void_p)


class Callbacks(ctypes.Structure):
    """NiteUserTrackerCallbacks."""

    _fields_ = (("ready_for_next_frame", FRAME_READY),)


OPENNI2_ARGUMENTS: dict[str, tuple[Any, ...]] = {
    "oniInitialize": (c_int,),
    "oniGetDeviceList": (POINTER(POINTER(DeviceInfo)), POINTER(c_int)),
    "oniReleaseDeviceList": (POINTER(DeviceInfo),),
    "oniDeviceOpen": (c_char_p, POINTER(c_void_p)),
    "oniDeviceClose": (c_void_p,),
}
NITE2_ARGUMENTS: dict[str, tuple[Any, ...]] = {
    "niteInitialize": (),
    "niteInitializeUserTracker": (POINTER(c_void_p),),
    "niteInitializeUserTrackerByDevice": (c_void_p, POINTER(c_void_p)),
    "niteShutdownUserTracker": (c_void_p,),
    "niteStartSkeletonTracking": (c_void_p, c_short),
    "niteReadUserTrackerFrame": (c_void_p, POINTER(POINTER(TrackerFrame))),
    "niteUserTrackerFrameRelease": (c_void_p, POINTER(TrackerFrame)),
    "niteRegisterUserTrackerCallbacks": (c_void_p, POINTER(Callbacks), c_void_p),
    "niteUnregisterUserTrackerCallbacks": (c_void_p, POINTER(Callbacks)),
}


class Nite2Library:
    """Both libraries, loaded.

    Args:
        folder: Folder of both libraries; empty: the system's search path.

    Raises:
        InputError: If one of them is missing.
    """

    def __init__(self, folder: str) -> None:
        # Both references are kept: OpenNI2 must outlive NiTE2, which uses it.
        self._openni = _load(folder, "libOpenNI2.so")
        self._nite = _load(folder, "libNiTE2.so")
        self._openni.oniGetExtendedError.restype = c_char_p
        for library, functions in (
            (self._openni, OPENNI2_ARGUMENTS),
            (self._nite, NITE2_ARGUMENTS),
        ):
            for name, arguments in functions.items():
                getattr(library, name).argtypes = arguments

    def initialize(self) -> None:
        """Initialise the libraries."""
        self._openni_call("oniInitialize", ONI_API_VERSION)
        try:
            self._nite_call("niteInitialize")
        except LibraryError:
            self._openni.oniShutdown()
            raise

    def shutdown(self) -> None:
        """Shut the libraries down; they can be initialised again."""
        self._nite.niteShutdown()
        self._openni.oniShutdown()

    def devices(self) -> list[str]:
        """The URIs of the connected sensors."""
        infos, count = POINTER(DeviceInfo)(), c_int()
        self._openni_call("oniGetDeviceList", byref(infos), byref(count))
        uris = [infos[i].uri.decode(errors="replace") for i in range(min(count.value, MAX_DEVICES))]
        self._openni.oniReleaseDeviceList(infos)
        return uris

    def open_device(self, uri: str) -> c_void_p:
        """Open a sensor; returns its handle, to be closed by :meth:`close_device`."""
        handle = c_void_p()
        self._openni_call("oniDeviceOpen", uri.encode(), byref(handle))
        return handle

    def close_device(self, handle: c_void_p) -> None:
        """Close a sensor."""
        self._openni.oniDeviceClose(handle)

    def create_tracker(self, device: c_void_p | None) -> c_void_p:
        """Create a tracker of people on a sensor; None: on any."""
        tracker = c_void_p()
        if device is None:
            self._nite_call("niteInitializeUserTracker", byref(tracker))
        else:
            wrapped = Device(handle=device)
            self._nite_call("niteInitializeUserTrackerByDevice", byref(wrapped), byref(tracker))
        return tracker

    def destroy_tracker(self, tracker: c_void_p) -> None:
        """Destroy a tracker."""
        self._nite.niteShutdownUserTracker(tracker)

    def register(self, tracker: c_void_p, callbacks: Callbacks) -> None:
        """Register callbacks, called from a thread of the library; keep a reference to them."""
        self._nite_call("niteRegisterUserTrackerCallbacks", tracker, byref(callbacks), None)

    def unregister(self, tracker: c_void_p, callbacks: Callbacks) -> None:
        """Unregister the callbacks."""
        self._nite.niteUnregisterUserTrackerCallbacks(tracker, byref(callbacks))

    def start_skeleton(self, tracker: c_void_p, user: int) -> None:
        """Track a person's joints from now on."""
        self._nite_call("niteStartSkeletonTracking", tracker, user)

    def read_frame(self, tracker: c_void_p) -> Any:
        """Pointer to the newest frame, to be released by :meth:`release_frame`.

        Raises:
            LibraryError: If NiTE2 gives none.
        """
        frame = POINTER(TrackerFrame)()
        self._nite_call("niteReadUserTrackerFrame", tracker, byref(frame))
        if not frame:
            raise LibraryError("niteReadUserTrackerFrame gave no frame")
        return frame

    def release_frame(self, tracker: c_void_p, frame: Any) -> None:
        """Release a frame."""
        self._nite.niteUserTrackerFrameRelease(tracker, frame)

    def _openni_call(self, name: str, *arguments: object) -> None:
        status = getattr(self._openni, name)(*arguments)
        if status != OK:
            said = (self._openni.oniGetExtendedError() or b"").decode(errors="replace").strip()
            raise LibraryError(f"{name} failed with status {status}: {said or 'no reason given'}")

    def _nite_call(self, name: str, *arguments: object) -> None:
        status = getattr(self._nite, name)(*arguments)
        if status != OK:
            raise LibraryError(f"{name} failed with status {status}")


def _load(folder: str, name: str) -> ctypes.CDLL:
    path = str(Path(folder).expanduser() / name) if folder else name
    try:
        return ctypes.CDLL(path, mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise InputError(
            f"cannot load {path} ({error}): install OpenNI2 and NiTE2 and give their folder as "
            "nite2_library"
        ) from error
