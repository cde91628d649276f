"""KinectMultiTrack's CSV: several Kinect v2, one row per person, camera and server tick.

``Tracker_Time`` [ms since year 1] is the server's clock, one for all cameras; ``Skeleton_Time``
[100 ns] is each camera's own. ``Kinect#`` (an address) is the sensor, ``Person#`` the person.
Joints are in camera space; -9999 is missing. There is no tracking state: joints with a position
count as tracked. Later files name the same columns ``…_Id`` instead of ``…#``.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from pose_core.joints import TrackingState
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.table import CsvTable, read_table
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_io.recordings.recording import Recording, SensorStream, make_recording, make_stream

KINECT_V2 = shipped_joint_map("kinect_v2")
NS_PER_MS = 1_000_000
NS_PER_SENSOR_TICK = 100
UNIX_EPOCH_MS = 62_135_596_800_000  # [ms] from 0001-01-01 to 1970-01-01
MISSING = -9999.0

RENAMED = {
    "Study_Id": "Study",
    "Kinect_Config": "KinectConfig",
    "Scenario_Id": "Scenario",
    "Person_Id": "Person#",
    "Skeleton_Id": "Skeleton#",
    "Kinect_Id": "Kinect#",
}
USED = ("Tracker_Time", "Skeleton_Time", "Kinect#", "Person#")
UNUSED = (
    *("Study", "KinectConfig", "Scenario", "Skeleton#"),
    *("Skeleton_Init_Angle", "Skeleton_Init_Dist", "Kinect_Tilt_Angle", "Kinect_Height"),
)
JOINT_COLUMNS = tuple(f"{joint}_{axis}" for joint in KINECT_V2.joints for axis in "XYZ")


def read(path: Path) -> Recording:
    """Read a file, see :class:`Format`."""
    table = read_table(path)
    table = replace(table, header=tuple(RENAMED.get(name, name) for name in table.header))
    table.refuse_unknown([*USED, *UNUSED, *JOINT_COLUMNS])
    used = table.columns(USED)
    joints = table.columns(JOINT_COLUMNS)
    by_sensor = table.rows_by(used[2])
    streams = [_stream(table, name, rows, used, joints) for name, rows in by_sensor.items()]
    return make_recording(str(path), "kinectmultitrack", streams)


def _stream(
    table: CsvTable, name: str, rows: list[int], used: list[int], joints: list[int]
) -> SensorStream:
    host, sensor, _, person = used
    numbers = np.array([table.numbers(row, joints) for row in rows])
    positions = numbers.reshape(len(rows), len(KINECT_V2.joints), 3)
    missing = (positions == MISSING) | ~np.isfinite(positions)
    positions[missing.any(axis=-1)] = np.nan
    state = np.full(positions.shape[:-1], TrackingState.TRACKED, dtype=np.uint8)
    positions, state = KINECT_V2.convert(positions, state)
    return make_stream(
        name,
        host_time_ns=[table.time_ns(row, host, NS_PER_MS, UNIX_EPOCH_MS) for row in rows],
        sensor_time_ns=[table.time_ns(row, sensor, NS_PER_SENSOR_TICK) for row in rows],
        person=[table.rows[row][person].strip() for row in rows],
        positions=positions,
        tracking_state=state,
    )


FORMAT = Format(key_columns=frozenset({"Tracker_Time", "Skeleton_Time"}), read=read)
