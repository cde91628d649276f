"""Readable recordings: one module per format, one line per format in ``FORMATS``."""

from pathlib import Path

from pose_core.errors import InputError
from pose_io.recordings.formats import (
    azure_csv,
    azure_json,
    kinectmultitrack,
    ntu,
    plain_csv,
    uiprmd,
    utd_mhad,
)
from pose_io.recordings.formats.file_content import read_beginning
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.table import read_header
from pose_io.recordings.recording import Recording

AUTO = "auto"
BEGINNING = 4096  # [bytes] from which a format is recognised

FORMATS: dict[str, Format] = {
    "kinectmultitrack": kinectmultitrack.FORMAT,
    "csv": plain_csv.FORMAT,
    "azure_csv": azure_csv.FORMAT,
    "azure_json": azure_json.FORMAT,
    "ntu": ntu.FORMAT,
    "utd_mhad": utd_mhad.FORMAT,
    "uiprmd": uiprmd.FORMAT,
}


def read_recording(path: Path, format_name: str = AUTO) -> Recording:
    """Read a recording.

    Args:
        path: The file, plain or gzip; of some formats a folder.
        format_name: A key of :data:`FORMATS`, or ``auto`` to recognise it by its beginning.

    Raises:
        InputError: If the file is missing or not of the format.
    """
    if format_name == AUTO:
        format_name = detect_format(path)
    return FORMATS[format_name].read(path)


def detect_format(path: Path) -> str:
    """Recognise a file's format by its beginning.

    Raises:
        InputError: If the file is missing or of no known format.
    """
    begin = read_beginning(path, BEGINNING)
    for name, candidate in FORMATS.items():
        if candidate.recognise(path, begin):
            return name
    header = read_header(path)
    with_header = {name: each for name, each in FORMATS.items() if each.key_columns}
    for name, candidate in with_header.items():
        if candidate.key_columns <= set(header):
            return name
    known = "; ".join(
        f"{name} ({', '.join(sorted(candidate.key_columns))}, …)"
        for name, candidate in with_header.items()
    )
    others = ", ".join(name for name in FORMATS if name not in with_header)
    shown = ", ".join(header)[:60]
    other_separator = len(header) == 1 and (";" in shown or "\t" in shown)
    separated = ", columns separated by commas, decimal points" if other_separator else ""
    raise InputError(
        f"{path} is of no known format: its header begins with {shown!r}, expected the columns "
        f"of {known}, or a file of {others}; convert it to the plain CSV that the README of "
        f"kinect_bridge describes{separated}"
    )
