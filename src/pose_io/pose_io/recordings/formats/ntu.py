"""NTU RGB+D's ``.skeleton``: one Kinect v2, one action per file.

Shahroudy, Liu, Ng, Wang (2016), NTU RGB+D: A Large Scale Dataset for 3D Human Activity Analysis,
CVPR. Text: the number of frames; for each frame the number of bodies; for each body a line that
begins with its id, the number of joints, and a line a joint: x y z [m], depth x y, colour x y,
orientation w x y z, tracking state. There are no times: frames are assumed to be 1/30 s apart.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_io.recordings.formats.file_content import read_content
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.sdk_rows import MAX_PEOPLE, SdkRows
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_io.recordings.recording import Recording

NAME = "ntu"
FRAME_RATE = 30.0  # [Hz] of a Kinect v2
BODY_VALUES, JOINT_VALUES = 10, 12
KINECT_V2 = shipped_joint_map("kinect_v2")
BEGIN = re.compile(rb"\s*\d+\s*\n\s*\d+\s*\n\s*(\d+( +-?[\d.]+){9}\s*\n\s*25\s|\d+\s*\n)")


class _Lines:
    """The file's lines, each with its number, for messages."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self._lines: Iterator[tuple[int, str]] = (
            (number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()
        )
        self._number = 0

    def values(self, count: int, meaning: str) -> list[str]:
        """The next line's values."""
        self._number, line = next(self._lines, (self._number + 1, ""))
        values = line.split()
        if len(values) != count:
            raise self.bad(f"{len(values)} values", f"{count}: {meaning}")
        return values

    def count(self, meaning: str, limit: int) -> int:
        """The next line's only value, a count."""
        (value,) = self.values(1, meaning)
        if not value.isdecimal() or int(value) > limit:
            raise self.bad(f"'{value[:20]}'", f"{meaning}, at most {limit}")
        return int(value)

    def numbers(self, meaning: str) -> list[float]:
        """The next line's numbers of a joint."""
        values = self.values(JOINT_VALUES, meaning)
        try:
            return [float(value) for value in values]
        except ValueError:
            raise self.bad(f"'{' '.join(values)[:40]}'", meaning) from None

    def bad(self, found: str, expected: str) -> InputError:
        """The error for the line that was read last."""
        return InputError(
            f"{self.path}, line {self._number}: found {found}, expected {expected}: the "
            "file is cut or damaged, copy it again"
        )


def read(path: Path) -> Recording:
    """Read a file, see :class:`Format`."""
    lines = _Lines(path, read_content(path).decode(errors="replace"))
    rows = SdkRows()
    joint_count = len(KINECT_V2.joints)
    for frame in range(lines.count("the number of frames", 1_000_000)):
        time_ns = round(frame * NS_PER_S / FRAME_RATE)
        bodies = lines.count("the number of bodies", MAX_PEOPLE)
        if not bodies:
            rows.add_nobody(time_ns, joint_count)
        for _ in range(bodies):
            person = lines.values(BODY_VALUES, "a body's id and states")[0]
            if lines.count("the number of joints, 25", joint_count) != joint_count:
                raise lines.bad("fewer joints", f"{joint_count}, as of Kinect v2")
            joints = [lines.numbers("a joint's numbers") for _ in range(joint_count)]
            rows.add(time_ns, person, [[*joint[:3], joint[-1]] for joint in joints])
    return rows.recording(path, NAME, KINECT_V2)


def recognise(path: Path, begin: bytes) -> bool:
    """Whether a file begins with counts, one a line, and a body."""
    return ".skeleton" in path.suffixes or BEGIN.match(begin) is not None


FORMAT = Format(read=read, recognise=recognise)
