"""Lines of numbers, as printed by Razor boards and Arduino sketches, with named fields.

``prefix`` (optional), then the numbers of ``fields`` in their order, separated by any of
``, ; : =``, blanks and tabs. A field is ``time``, ``node``, one of ``acc_x … mag_z``, or ``_``
for an ignored number; ``-acc_x`` means that the axis is printed with the opposite sign.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from imu_bridge.protocols.reading import STANDARD_GRAVITY, Reading, Vector3
from pose_core.counters import Counters
from pose_core.errors import InputError

MAX_LINE_BYTES = 512
MAX_NODE = 65_535  # [-] larger ids are corrupted lines
IGNORED = "_"
AXES = ("x", "y", "z")
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1e6, "ms": 1e3, "us": 1.0},  # [us]
    "acc": {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY},  # [m/s^2]
    "gyro": {"rad/s": 1.0, "deg/s": math.radians(1.0)},  # [rad/s]
    "mag": {"T": 1.0, "uT": 1e-6, "G": 1e-4, "mG": 1e-7},  # [T]
}
"""Units of each quantity, with their value in SI units (time: us)."""
FIELDS = ("time", "node", *(f"{q}_{axis}" for q in ("acc", "gyro", "mag") for axis in AXES))

_SEPARATOR = re.compile(r"[,;:=\s]+")


@dataclass(frozen=True, kw_only=True)
class LineFormat:
    """Format of a line."""

    columns: Mapping[str, int]  # by field name
    scales: Mapping[str, float]  # value of one unit in SI units (time: us), by field name
    width: int  # count of numbers in a line
    prefix: str = ""  # beginning of a line of data


def line_format(options: Mapping[str, Any]) -> LineFormat:
    """The format from a port's ``fields``, ``units`` and ``prefix``.

    Raises:
        InputError: If a field or unit is unknown, missing or given twice.
    """
    fields, units = options.get("fields"), options.get("units", {})
    prefix = options.get("prefix", "")
    if not isinstance(fields, list) or not all(isinstance(field, str) for field in fields):
        raise InputError(f"fields = {fields!r} is not a list such as [time, acc_x, acc_y, …]")
    if not isinstance(units, Mapping) or not isinstance(prefix, str):
        raise InputError("expected units as a mapping such as {acc: g}, and prefix as a text")
    columns: dict[str, int] = {}
    signs: dict[str, float] = {}
    for column, field in enumerate(fields):
        name = field.removeprefix("-")
        if name == IGNORED:
            continue
        if name not in FIELDS:
            raise InputError(f"field '{field}' is not one of {', '.join(FIELDS)}, {IGNORED}")
        if name in columns:
            raise InputError(f"field '{name}' occurs twice")
        columns[name], signs[name] = column, -1.0 if field.startswith("-") else 1.0
    _refuse_missing(columns)
    scales = {name: signs[name] * _unit(name, units) for name in columns if name != "node"}
    return LineFormat(columns=columns, scales=scales, width=len(fields), prefix=prefix)


def _refuse_missing(columns: Mapping[str, int]) -> None:
    for quantity in ("acc", "gyro", "mag"):
        wanted = [f"{quantity}_{axis}" for axis in AXES]
        missing = [name for name in wanted if name not in columns]
        if missing and (quantity != "mag" or len(missing) < len(AXES)):
            raise InputError(f"fields name no {', '.join(missing)}: all three axes are needed")


def _unit(name: str, units: Mapping[str, Any]) -> float:
    """Unit of a field, by name or, for counts, as a number, in SI units."""
    quantity = name.partition("_")[0]
    unit, known = units.get(quantity), UNITS[quantity]
    if isinstance(unit, int | float) and not isinstance(unit, bool) and unit > 0.0:
        return float(unit) * (1e6 if quantity == "time" else 1.0)
    if unit not in known:
        raise InputError(
            f"unit of {quantity} = {unit!r} is not one of {', '.join(known)}, nor a number "
            "(the SI value of one count)"
        )
    return known[unit]


class TextParser:
    """A :class:`Parser` of such lines.

    Attributes:
        counters: ``frames``: valid lines; ``bad_lines``: lines with the prefix and a wrong count of
            numbers or an invalid value; ``other_lines``: lines without the prefix;
            ``bytes_skipped``: bytes of invalid lines, of the incomplete first line, and of lines
            that are too long.
        clock_modulus_us: A 32-bit count in the unit of ``time``, as Arduino's clocks are.
    """

    def __init__(self, format_: LineFormat) -> None:
        self.counters = Counters("frames", "bad_lines", "other_lines", "bytes_skipped")
        self._format = format_
        self.clock_modulus_us = round(2**32 * abs(format_.scales.get("time", 1.0)))
        self._pending = b""
        self._joined = False  # whether the beginning of a line has been received

    def parse(self, data: bytes) -> list[Reading]:
        """See :class:`Parser`."""
        *lines, rest = (self._pending + data).split(b"\n")
        readings = []
        for line in lines:
            if not self._joined:
                # The end of an incomplete first line may be mistaken for a whole line.
                self._joined = True
                self.counters.add("bytes_skipped", len(line) + 1)
                continue
            reading = self._line(line)
            if reading is not None:
                readings.append(reading)
        if len(rest) > MAX_LINE_BYTES:
            self.counters.add("bytes_skipped", len(rest))
            rest, self._joined = b"", False
        self._pending = rest
        return readings

    def finish(self) -> list[Reading]:
        """See :class:`Parser`."""
        self.counters.add("bytes_skipped", len(self._pending))
        self._pending, self._joined = b"", False
        return []

    def _line(self, line: bytes) -> Reading | None:
        text = line.decode("ascii", errors="replace").strip()
        if not text.startswith(self._format.prefix):
            self._refuse("other_lines", line)
            return None
        words = _SEPARATOR.split(text[len(self._format.prefix) :].strip(",;:= \t"))
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        reading = self._reading(numbers) if len(numbers) == self._format.width else None
        if reading is None:
            self._refuse("bad_lines", line)
        else:
            self.counters.add("frames")
        return reading

    def _refuse(self, reason: str, line: bytes) -> None:
        self.counters.add(reason)
        self.counters.add("bytes_skipped", len(line) + 1)

    def _reading(self, numbers: list[float]) -> Reading | None:
        """The numbers in SI units; None if one of them is not finite or too large."""
        columns, scales = self._format.columns, self._format.scales
        values = {name: numbers[columns[name]] * scale for name, scale in scales.items()}
        node = numbers[columns["node"]] if "node" in columns else 0.0
        if not all(map(math.isfinite, (*numbers, *values.values()))) or abs(node) > MAX_NODE:
            return None
        time_us = values.get("time")

        def vector(quantity: str) -> Vector3:
            return (values[f"{quantity}_x"], values[f"{quantity}_y"], values[f"{quantity}_z"])

        return Reading(
            angular_velocity=vector("gyro"),
            acceleration=vector("acc"),
            magnetic_field=vector("mag") if "mag_x" in columns else None,
            node_id=int(node),
            clock_us=None if time_us is None else round(time_us) % self.clock_modulus_us,
        )
