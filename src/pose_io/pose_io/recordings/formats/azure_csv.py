"""Azure Kinect's joints as a table: ``timestamp;body_idx;PELVIS (c);PELVIS (x);…``.

One row per body and frame, semicolons between: ``timestamp`` [µs] is the device's, positions are
in mm, ``(c)`` is the SDK's confidence level from 0 to 3. There is no host clock.
"""

from pathlib import Path

from pose_core.stamps import NS_PER_US
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.sdk_rows import SdkRows
from pose_io.recordings.formats.table import read_table
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_io.recordings.recording import Recording

NAME = "azure_csv"
AZURE_KINECT = shipped_joint_map("azure_kinect")
USED = ("timestamp", "body_idx")
JOINT_COLUMNS = tuple(f"{joint} ({value})" for joint in AZURE_KINECT.joints for value in "xyzc")


def read(path: Path) -> Recording:
    """Read a file, see :class:`Format`."""
    table = read_table(path, delimiter=";")
    table.refuse_unknown([*USED, *JOINT_COLUMNS])
    time, body = table.columns(USED)
    columns = table.columns(JOINT_COLUMNS)
    rows = SdkRows()
    for row, cells in enumerate(table.rows):
        numbers = table.numbers(row, columns)
        joints = [numbers[i : i + 4] for i in range(0, len(numbers), 4)]
        rows.add(table.time_ns(row, time, NS_PER_US), cells[body].strip(), joints)
    return rows.recording(path, NAME, AZURE_KINECT)


def recognise(_path: Path, begin: bytes) -> bool:
    """Whether a file begins with the two columns that all such files have."""
    return begin.removeprefix(b"\xef\xbb\xbf").startswith(b"timestamp;body_idx;")


FORMAT = Format(read=read, recognise=recognise)
