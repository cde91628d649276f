"""Azure Kinect's joints as JSON, in the two shapes that programs of its SDK write.

One file: ``{"frames": [{"timestamp_usec": …, "bodies": [{"body_id": …, "joint_positions":
[[x, y, z], …]}]}]}`` as Microsoft's offline processor writes it [mm], with confidence levels in
some programs. Or a folder with one file per frame, ``sk_<UNIX second>_<device time in µs>.txt``:
a list of 32 joints, x, y, z [mm] and a quaternion, of one body. Times are the device's.
"""

import re
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S, NS_PER_US
from pose_io.recordings.formats.file_content import read_content
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.sdk_rows import MAX_PEOPLE, SdkRows
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_io.recordings.recording import Recording

NAME = "azure_json"
PERSON = "0"  # of a file a frame
FRAME_FILE = re.compile(r"sk_(\d{1,12})_(\d{1,15})\.txt")
MAX_FRAME_BYTES = 65_536  # of a file a frame
AZURE_KINECT = shipped_joint_map("azure_kinect")

Triples = list[list[float | None]]
Levels = list[float | list[float]]


class BodyData(msgspec.Struct):
    """One body of a frame."""

    body_id: int
    joint_positions: Triples
    confidence_levels: Levels | None = None
    joint_confidence: Levels | None = None


class FrameData(msgspec.Struct):
    """One frame; one of the times is there."""

    bodies: list[BodyData]
    timestamp_usec: int | None = None
    timestamp_unix: int | None = None


class Document(msgspec.Struct):
    """The whole file."""

    frames: list[FrameData]


def read(path: Path) -> Recording:
    """Read a file, or a folder of one file a frame, see :class:`Format`."""
    rows = _read_folder(path) if path.is_dir() else _read_file(path)
    return rows.recording(path, NAME, AZURE_KINECT)


def _read_file(path: Path) -> SdkRows:
    rows = SdkRows()
    for number, frame in enumerate(_decode(path, read_content(path), Document).frames):
        time_us = frame.timestamp_usec if frame.timestamp_unix is None else frame.timestamp_unix
        if time_us is None or not 0 <= time_us < 2**50:
            raise InputError(
                f"{path}: frame {number} has the time {time_us}, expected microseconds in "
                "timestamp_usec"
            )
        if not frame.bodies:
            rows.add_nobody(time_us * NS_PER_US, len(AZURE_KINECT.joints))
        for body in frame.bodies[:MAX_PEOPLE]:
            levels = body.confidence_levels or body.joint_confidence
            joints = _joints(path, f"frame {number}", body.joint_positions, levels)
            rows.add(time_us * NS_PER_US, str(body.body_id), joints)
    return rows


def _read_folder(folder: Path) -> SdkRows:
    found = [(FRAME_FILE.fullmatch(path.name), path) for path in folder.iterdir()]
    files = sorted((int(match[2]), int(match[1]), path) for match, path in found if match)
    if not files:
        raise InputError(
            f"cannot read {folder}: it is a folder without frames sk_<second>_<microsecond>.txt"
        )
    first_us, first_s, _ = files[0]
    rows = SdkRows()
    for time_us, _, path in files:
        # Only the first host time counts: it has whole seconds.
        time_ns = first_s * NS_PER_S + (time_us - first_us) * NS_PER_US
        triples = _decode(path, read_content(path, MAX_FRAME_BYTES), Triples)
        rows.add(time_ns, PERSON, _joints(path, "the file", triples, None))
    return rows


def _joints(path: Path, where: str, positions: Triples, levels: Levels | None) -> list[list[float]]:
    """x, y, z and confidence of each joint; NaN where something is missing."""
    count = len(AZURE_KINECT.joints)
    given: Levels = [np.nan] * len(positions) if levels is None else levels
    if not len(positions) == len(given) == count or any(len(p) < 3 for p in positions):
        raise InputError(
            f"{path}: {where} has {len(positions)} joints and {len(given)} confidence levels, "
            f"expected {count} of each, with x, y and z"
        )
    return [
        [*(np.nan if value is None else value for value in place[:3]), _level(level)]
        for place, level in zip(positions, given, strict=True)
    ]


def _level(value: float | list[float]) -> float:
    """A confidence level, which some programs write as a list of one."""
    if isinstance(value, list):
        return value[0] if value else np.nan
    return value


def _decode(path: Path, data: bytes, kind: Any) -> Any:
    try:
        return msgspec.json.decode(data, type=kind)
    except (msgspec.DecodeError, RecursionError) as error:
        raise InputError(
            f"{path} is not an Azure Kinect's JSON ({error}): expected frames with bodies with "
            "joint_positions"
        ) from error


def recognise(path: Path, begin: bytes) -> bool:
    """Whether it is a folder, or a file that begins as JSON."""
    return path.is_dir() or begin.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{"


FORMAT = Format(read=read, recognise=recognise)
