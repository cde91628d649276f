"""NiTE2's source against substitute libraries with the same functions, which replay a recording."""

import ctypes
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE_S

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.nite2 import Nite2Source
from pose_core.errors import InputError
from pose_core.joints import JOINT_INDEX
from pose_io.recordings.joint_map_files import shipped_joint_map

SOURCE = Path(__file__).parents[2] / "support" / "fake_nite2"
VISIBLE, LOST = 1, 4
NOT_TRACKED, TRACKED = 0, 2
JOINTS = shipped_joint_map("nite2").joints


@pytest.fixture(scope="module")
def libraries(tmp_path_factory) -> Path:
    """The folder of the two libraries, compiled."""
    folder = tmp_path_factory.mktemp("nite2")
    for name, source in (("libOpenNI2.so", "openni2.c"), ("libNiTE2.so", "nite2.c")):
        flags = ["-shared", "-fPIC", "-pthread", "-O1", "-Wall", "-Wextra", "-Werror"]
        command = ["gcc", *flags, "-o", str(folder / name), str(SOURCE / source)]
        subprocess.run(command, check=True)
    return folder


def user(number: int, state: int = VISIBLE, skeleton: int = TRACKED, confidence=1.0) -> str:
    """A user of a frame: every joint at (100 * number, index, 2000) mm."""
    joints = (f"{100 * number} {joint} 2000 {confidence}" for joint in range(len(JOINTS)))
    return f"{number} {state} {skeleton} {' '.join(joints)}"


class Sensor:
    """The recording and the plug of the fake sensor, and the source that reads it."""

    def __init__(self, libraries: Path, folder: Path, monkeypatch) -> None:
        self.plug, self.recording = folder / "plugged", folder / "recording.txt"
        monkeypatch.setenv("FAKE_NITE_PLUGGED", str(self.plug))
        monkeypatch.setenv("FAKE_NITE_RECORDING", str(self.recording))
        self._libraries = libraries
        self.plug.touch()
        self.source: Nite2Source | None = None

    def record(self, *users: str, frames: int = 500) -> None:
        lines = (f"{1_000_000 + 20_000 * i} {' '.join(users)}" for i in range(frames))
        self.recording.write_text("\n".join(lines) + "\n")

    def start(self, **parameters) -> Nite2Source:
        values = {"source": "nite2", "nite2_library": str(self._libraries), **parameters}
        self.source = Nite2Source(KinectBridgeParameters(**values))
        self.source.start(time.time_ns, lambda: None)
        return self.source

    def wait(self, condition) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline, self.source.report()
            time.sleep(0.01)

    def frame(self, wanted=lambda frame: True):
        """The next frame that fulfils a condition."""
        found = []

        def look() -> bool:
            while (frame := self.source.take()) is not None:
                if wanted(frame):
                    found.append(frame)
                    return True
            return False

        self.wait(look)
        return found[0]


@pytest.fixture
def sensor(libraries, tmp_path, monkeypatch):
    made = Sensor(libraries, tmp_path, monkeypatch)
    yield made
    if made.source is not None:
        made.source.close()
    assert ctypes.CDLL(str(libraries / "libNiTE2.so")).fake_frames_out() == 0
    openni = ctypes.CDLL(str(libraries / "libOpenNI2.so"))
    assert (openni.fake_open_devices(), openni.fake_initialized()) == (0, 0)


def test_detected_users_are_tracked_and_become_people(sensor):
    sensor.record(user(1), user(3))
    sensor.start()

    frame = sensor.frame(lambda frame: len(frame.person) == 2)

    assert frame.person == ("1", "3")
    elbow = JOINTS.index("LEFT_ELBOW")
    place = frame.positions[1, JOINT_INDEX["left_elbow"]]
    np.testing.assert_allclose(place, [0.3, -elbow / 1000, 2.0], atol=1e-6)
    assert (frame.tracking_state == 2).all()


def test_confidence_of_a_half_is_inferred_and_zero_is_not_tracked(sensor):
    sensor.record(user(1, confidence=0.5), user(2, confidence=0.0), user(3))
    source = sensor.start()

    frame = sensor.frame(lambda frame: len(frame.person) == 2)

    assert frame.person == ("1", "3")
    assert (frame.tracking_state[0] == 1).all()
    assert source.counters["people_without_joints"] > 0


def test_a_user_that_is_lost_is_no_person(sensor):
    sensor.record(user(1), user(2, state=LOST))
    source = sensor.start()

    assert sensor.frame(lambda frame: frame.person).person == ("1",)
    assert source.counters["users_not_tracked"] > 0


def test_stamps_keep_the_sensor_s_spacing_on_the_host_s_clock(sensor):
    sensor.record(user(1))
    began_ns = time.time_ns()
    sensor.start()

    first, *others = [sensor.frame() for _ in range(20)]

    stamps = np.array([first.stamp_ns, *(frame.stamp_ns for frame in others)])
    assert (np.diff(stamps) > 0).all()
    assert began_ns < stamps[0] < time.time_ns()


def test_an_unplugged_sensor_is_detected_and_reopened(sensor):
    sensor.record(user(1))
    source = sensor.start()
    sensor.frame(lambda frame: frame.person)

    sensor.plug.unlink()
    sensor.wait(lambda: source.counters["sensor_lost"] == 1)
    sensor.wait(lambda: "failed" in source.report().values["trouble"])
    while source.take() is not None:
        pass
    sensor.plug.touch()
    sensor.frame(lambda frame: frame.person)

    assert source.counters["sensor_opened"] == 2
    assert source.report().values["trouble"] == ""


def test_a_sensor_that_is_plugged_in_later_is_found(sensor):
    sensor.plug.unlink()
    sensor.record(user(1))
    source = sensor.start()
    sensor.wait(lambda: "failed" in source.report().values["trouble"])

    sensor.plug.touch()

    assert sensor.frame(lambda frame: frame.person).person == ("1",)


@pytest.mark.parametrize("device", ["0", "fake://0"])
def test_a_sensor_is_chosen_by_index_or_uri(sensor, device):
    sensor.record(user(1))
    sensor.start(nite2_device=device)

    assert sensor.frame(lambda frame: frame.person).person == ("1",)


def test_a_missing_sensor_is_in_the_report(sensor):
    sensor.record(user(1))
    source = sensor.start(nite2_device="1")

    trouble = "1 sensors are plugged in: no sensor with the index 1"
    sensor.wait(lambda: trouble in source.report().values["trouble"])


def test_libraries_that_are_missing_are_one_line_that_names_them(tmp_path):
    parameters = KinectBridgeParameters(source="nite2", nite2_library=str(tmp_path))
    with pytest.raises(InputError, match=r"cannot load .*libOpenNI2.so"):
        Nite2Source(parameters)
