"""The recordings that can be read: one module a format, one line a format in ``FORMATS``."""

from pathlib import Path

from pose_core.errors import InputError
from pose_io.recordings.formats import kinectmultitrack, plain_csv, uiprmd
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.table import read_header
from pose_io.recordings.recording import Recording

AUTO = "auto"

FORMATS: dict[str, Format] = {
    "kinectmultitrack": kinectmultitrack.FORMAT,
    "csv": plain_csv.FORMAT,
    "uiprmd": uiprmd.FORMAT,
}


def read_recording(path: Path, format_name: str = AUTO) -> Recording:
    """Read a recording.

    Args:
        path: The file, plain or gzip.
        format_name: A key of :data:`FORMATS`, or ``auto`` to know it by its header.

    Raises:
        InputError: If the file is missing or not what it should be.
    """
    if format_name == AUTO:
        format_name = detect_format(path)
    return FORMATS[format_name].read(path)


def detect_format(path: Path) -> str:
    """Know a file's format by its header.

    Raises:
        InputError: If the file is missing or of no known format.
    """
    header = read_header(path)
    with_header = {name: each for name, each in FORMATS.items() if each.key_columns}
    for name, candidate in with_header.items():
        if candidate.key_columns <= set(header):
            return name
    known = "; ".join(
        f"{name} ({', '.join(sorted(candidate.key_columns))}, …)"
        for name, candidate in with_header.items()
    )
    begin = ", ".join(header)[:60]
    raise InputError(
        f"{path} is of no known format: its header begins with {begin!r}, expected the columns "
        f"of {known}; convert it to the plain CSV that the README of kinect_bridge describes"
    )
