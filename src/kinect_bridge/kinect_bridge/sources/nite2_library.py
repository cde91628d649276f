"""Bindings (ctypes) of the C functions of OpenNI2 and NiTE2 for skeletons.

The libraries are installed by the user, in one folder or the system's search path. Layouts are
those of ``OniCTypes.h`` 2.2 and ``NiteCTypes.h`` 2.2.
"""

import ctypes
from collections.abc import Callable
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


OPENNI2_FUNCTIONS: dict[str, tuple[Any, ...]] = {
    "oniInitialize": (c_int,),
    "oniGetDeviceList": (POINTER(POINTER(DeviceInfo)), POINTER(c_int)),
    "oniReleaseDeviceList": (POINTER(DeviceInfo),),
    "oniDeviceOpen": (c_char_p, POINTER(c_void_p)),
    "oniDeviceClose": (c_void_p,),
}
NITE2_FUNCTIONS: dict[str, tuple[Any, ...]] = {
    "niteInitialize": (),
    "niteInitializeUserTracker": (POINTER(c_void_p),),
    "niteInitializeUserTrackerByDevice": (POINTER(Device), POINTER(c_void_p)),
    "niteShutdownUserTracker": (c_void_p,),
    "niteStartSkeletonTracking": (c_void_p, c_short),
    "niteReadUserTrackerFrame": (c_void_p, POINTER(POINTER(TrackerFrame))),
    "niteUserTrackerFrameRelease": (c_void_p, POINTER(TrackerFrame)),
    "niteRegisterUserTrackerCallbacks": (c_void_p, POINTER(Callbacks), c_void_p),
    "niteUnregisterUserTrackerCallbacks": (c_void_p, POINTER(Callbacks)),
}
"""Types of the functions' arguments."""
WITHOUT_STATUS = (
    "oniReleaseDeviceList",
    "oniDeviceClose",
    "niteShutdownUserTracker",
    "niteUserTrackerFrameRelease",
    "niteUnregisterUserTrackerCallbacks",
)


class Nite2Library:
    """Both libraries, loaded; their functions raise a :class:`LibraryError` if they fail.

    Args:
        folder: Folder of both libraries; empty: the system's search path.

    Attributes:
        openni: OpenNI2, which NiTE2 uses: it must outlive it.
        nite: NiTE2.

    Raises:
        InputError: If one of them is missing.
    """

    def __init__(self, folder: str) -> None:
        self.openni = _load(folder, "libOpenNI2.so", OPENNI2_FUNCTIONS, self._reason)
        self.nite = _load(folder, "libNiTE2.so", NITE2_FUNCTIONS, lambda: "")
        self.openni.oniGetExtendedError.restype = c_char_p

    def devices(self) -> list[str]:
        """The URIs of the connected sensors."""
        infos, count = POINTER(DeviceInfo)(), c_int()
        self.openni.oniGetDeviceList(byref(infos), byref(count))
        uris = [infos[i].uri.decode(errors="replace") for i in range(min(count.value, MAX_DEVICES))]
        self.openni.oniReleaseDeviceList(infos)
        return uris

    def _reason(self) -> str:
        said = (self.openni.oniGetExtendedError() or b"").decode(errors="replace").strip()
        return f": {said or 'no reason given'}"


def _load(
    folder: str, name: str, functions: dict[str, tuple[Any, ...]], reason: Callable[[], str]
) -> ctypes.CDLL:
    path = str(Path(folder).expanduser() / name) if folder else name
    try:
        library = ctypes.CDLL(path, mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise InputError(
            f"cannot load {path} ({error}): install OpenNI2 and NiTE2 and give their folder as "
            "nite2_library"
        ) from error

    def check(status: int, function: Any, _arguments: Any) -> None:
        if status != OK:
            raise LibraryError(f"{function.__name__} failed with status {status}{reason()}")

    for function_name, arguments in functions.items():
        function = getattr(library, function_name)
        function.argtypes = arguments
        if function_name not in WITHOUT_STATUS:
            function.errcheck = check
    return library
