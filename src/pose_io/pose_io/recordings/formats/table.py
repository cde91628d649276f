"""Text tables, compressed or not: cells with their line numbers, and errors that name them."""

import csv
import io
import math
from codecs import getincrementaldecoder
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, TextIO

from pose_core.errors import InputError
from pose_io.recordings.formats.file_content import MAX_TABLE_BYTES, read_beginning, read_content

DIALECT: dict[str, Any] = {"skipinitialspace": True}
HEAD_BYTES = 1 << 20  # [bytes] that hold comments and header
MAX_NS = 2**62  # [ns] about 146 years around any epoch


@dataclass(frozen=True, kw_only=True)
class CsvTable:
    """The rows of a file under its header."""

    path: Path
    comments: tuple[str, ...]  # lines that began with '#', without it
    header: tuple[str, ...]
    header_line: int
    rows: list[list[str]]
    lines: list[int]  # the line number of each row

    def columns(self, names: Sequence[str]) -> list[int]:
        """Indices of the columns.

        Raises:
            InputError: If some are missing.
        """
        missing = [name for name in names if name not in self.header]
        if missing:
            raise InputError(
                f"{self.path}, line {self.header_line}: the header lacks "
                f"{_listed(missing)}: add what is missing or export the recording again"
            )
        return [self.header.index(name) for name in names]

    def refuse_unknown(self, known: Sequence[str]) -> None:
        """Raise an InputError if there are unknown columns, or a column occurs twice."""
        where = f"{self.path}, line {self.header_line}"
        unknown = [name for name in self.header if name not in set(known)]
        if unknown:
            raise InputError(
                f"{where}: unknown {_listed(unknown)}: remove it or correct the name, "
                f"the README of kinect_bridge lists the format's columns"
            )
        twice = sorted({name for name in self.header if self.header.count(name) > 1})
        if twice:
            raise InputError(f"{where}: {_listed(twice)} occurs twice: keep one")

    def rows_by(self, column: int) -> dict[str, list[int]]:
        """The rows that have the same text in a column, by that text in order of appearance."""
        rows: dict[str, list[int]] = {}
        for row, cells in enumerate(self.rows):
            rows.setdefault(cells[column].strip(), []).append(row)
        return rows

    def numbers(self, row: int, columns: Sequence[int]) -> list[float]:
        """The numbers in a row's columns; an empty cell is NaN.

        Raises:
            InputError: If a cell is something else.
        """
        cells = self.rows[row]
        try:
            return [float(cells[column]) for column in columns]
        except ValueError:
            return [self._number(row, column) for column in columns]

    def _number(self, row: int, column: int) -> float:
        text = self.rows[row][column].strip()
        try:
            return float(text) if text else math.nan
        except ValueError:
            raise self.bad_cell(row, column, "a number") from None

    def time_ns(self, row: int, column: int, unit_ns: int, zero: int = 0) -> int:
        """A time [ns] from a decimal number of units since ``zero``, exact to the nanosecond.

        Raises:
            InputError: If the cell is no finite number or does not fit.
        """
        try:
            value = (Decimal(self.rows[row][column].strip()) - zero) * unit_ns
            fits = abs(value) <= MAX_NS  # checked before it is converted to an integer
        except (ArithmeticError, ValueError):
            raise self.bad_cell(row, column, "a time") from None
        if not fits:
            raise self.bad_cell(row, column, f"a time of at most {MAX_NS // 10**9} s")
        return int(value.to_integral())

    def bad_cell(self, row: int, column: int, expected: str) -> InputError:
        """The error for a cell that cannot be used."""
        return InputError(
            f"{self.path}, line {self.lines[row]}: column '{self.header[column]}' holds "
            f"'{self.rows[row][column][:40]}', expected {expected}: correct the cell or remove "
            f"the row"
        )


def read_header(path: Path) -> tuple[str, ...]:
    """The names of a table's columns.

    Raises:
        InputError: If the file is missing, empty or no text table.
    """
    with _text(path, read_beginning(path, HEAD_BYTES), is_whole=False) as stream:
        return _head(stream, path).header


def read_table(path: Path, delimiter: str = ",") -> CsvTable:
    """Read a whole table.

    Raises:
        InputError: If the file is missing, no text table, or has a row of another length than
            the header.
    """
    with _text(path, read_content(path, MAX_TABLE_BYTES), is_whole=True) as stream:
        table = _head(stream, path, delimiter)
        reader = csv.reader(stream, delimiter=delimiter, **DIALECT)
        for row in reader:
            if not row:
                continue
            line = table.header_line + reader.line_num
            if len(row) != len(table.header):
                raise InputError(
                    f"{path}, line {line}: the row has {len(row)} cells, the header "
                    f"{len(table.header)}: complete the row or remove it"
                )
            table.rows.append(row)
            table.lines.append(line)
    return table


def _head(stream: TextIO, path: Path, delimiter: str = ",") -> CsvTable:
    """Read the comments and the header; the stream's position is then the first row."""
    comments = []
    for number, line in enumerate(iter(stream.readline, ""), start=1):
        if line.startswith("#"):
            comments.append(line.lstrip("#").strip())
        elif line.strip():
            cells = next(csv.reader([line], delimiter=delimiter, **DIALECT))
            return CsvTable(
                path=path,
                comments=tuple(comments),
                header=tuple(cell.strip() for cell in cells),
                header_line=number,
                rows=[],
                lines=[],
            )
    raise InputError(f"{path} is empty: expected a table with a header; record again")


@contextmanager
def _text(path: Path, data: bytes, *, is_whole: bool) -> Iterator[TextIO]:
    """A file's content as a text stream; raises InputError if it is not text."""
    try:
        # A beginning may end in the middle of a character.
        text = getincrementaldecoder("utf-8-sig")().decode(data, final=is_whole)
        yield io.StringIO(text, newline="")
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            f"{path} is not a text table ({error}): expected CSV, plain or gzip"
        ) from error


def _listed(names: Sequence[str]) -> str:
    shown = 5
    more = f" and {len(names) - shown} more" if len(names) > shown else ""
    quoted = ", ".join(f"'{name}'" for name in names[:shown])
    return f"column{'s' * (len(names) > 1)} {quoted}{more}"
