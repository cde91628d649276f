"""Reader and writer of the plain CSV format that the README of this package describes."""

import csv
import gzip
import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError, writing
from pose_core.finite_numbers import nan_median
from pose_core.joints import FARTHEST_M, JOINTS, TrackingState
from pose_core.stamps import NS_PER_S
from pose_io.arrays import ByteArray
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.table import CsvTable, read_table
from pose_io.recordings.recording import Recording, SensorStream, make_recording, make_stream

TIME_ZERO = "time_zero_s:"  # the comment that sets Recording.time_zero_ns

POSITION_COLUMNS = tuple(f"{joint}_{axis}" for joint in JOINTS for axis in "xyz")
STATE_COLUMNS = tuple(f"{joint}_state" for joint in JOINTS)
COLUMNS = (
    *("sensor", "host_time_s", "sensor_time_s", "person"),
    *(f"{joint}_{value}" for joint in JOINTS for value in ("x", "y", "z", "state")),
)
STATES = tuple(float(state) for state in TrackingState)
MAX_STEP_S = 2.0  # [s] median time between a sensor's frames
ROUNDED_STEP_S = 0.5  # [s] the same, from which on frames left by rounded times are of no use


def read(path: Path) -> Recording:
    """Read a file, see :class:`Format`."""
    table = read_table(path)
    table.refuse_unknown(COLUMNS)
    table.columns([name for name in COLUMNS if name != "sensor_time_s"])
    by_sensor = table.rows_by(table.header.index("sensor"))
    streams = [_stream(table, name, rows) for name, rows in by_sensor.items()]
    for stream in streams:
        _refuse_other_units(path, stream)
    return make_recording(
        str(path),
        "csv",
        streams,
        time_zero_ns=_time_zero_ns(table),
        comments=[text for text in table.comments if not text.startswith(TIME_ZERO)],
    )


def _refuse_other_units(path: Path, stream: SensorStream) -> None:
    """Raise an InputError if positions cannot be in metres, or times not in seconds."""
    distance = float(nan_median(np.linalg.norm(stream.positions, axis=2).ravel()))
    if distance > FARTHEST_M:
        raise InputError(
            f"{path}: the joints are {distance:.0f} m from sensor '{stream.name}' (median), "
            f"expected at most {FARTHEST_M:g} m: write positions in metres"
        )
    steps_ns = np.diff(np.sort(stream.host_time_ns))
    step_s = float(np.median(steps_ns)) / NS_PER_S if len(steps_ns) else 0.0
    if step_s > MAX_STEP_S:
        raise InputError(
            f"{path}: {step_s:.3g} s lie between two frames of sensor '{stream.name}' (median), "
            f"expected at most {MAX_STEP_S:g} s: write host_time_s in seconds"
        )
    if step_s >= ROUNDED_STEP_S and stream.rows_repeated > len(stream.person):
        rows = len(stream.person) + stream.rows_repeated
        raise InputError(
            f"{path}: {stream.rows_repeated} of {rows} rows of sensor '{stream.name}' have the "
            "time of another row: host_time_s is rounded; write it with milliseconds"
        )


def _time_zero_ns(table: CsvTable) -> int | None:
    for number, text in enumerate(table.comments, start=1):
        if text.startswith(TIME_ZERO):
            cells = [[text.removeprefix(TIME_ZERO)]]
            comment = replace(table, header=("# " + TIME_ZERO,), rows=cells, lines=[number])
            return comment.time_ns(0, 0, NS_PER_S)
    return None


def _stream(table: CsvTable, name: str, rows: list[int]) -> SensorStream:
    host, person = table.columns(["host_time_s", "person"])
    sensor_time_ns = _sensor_times_ns(table, rows)
    positions = table.columns(POSITION_COLUMNS)
    states = table.columns(STATE_COLUMNS)
    return make_stream(
        name,
        host_time_ns=[table.time_ns(row, host, NS_PER_S) for row in rows],
        sensor_time_ns=sensor_time_ns,
        person=[_person(table, row, person, [*positions, *states]) for row in rows],
        positions=np.array([table.numbers(row, positions) for row in rows]),
        tracking_state=np.array([_states(table, row, states) for row in rows], dtype=np.uint8),
        sort_frames=sensor_time_ns is None,
    )


def _sensor_times_ns(table: CsvTable, rows: list[int]) -> list[int] | None:
    """The sensor's own clock, or None if its cells are empty."""
    if "sensor_time_s" not in table.header:
        return None
    column = table.header.index("sensor_time_s")
    filled = [row for row in rows if table.rows[row][column].strip()]
    if not filled:
        return None
    if len(filled) < len(rows):
        empty = next(row for row in rows if not table.rows[row][column].strip())
        raise table.bad_cell(empty, column, "a time as in the sensor's other rows")
    return [table.time_ns(row, column, NS_PER_S) for row in rows]


def _person(table: CsvTable, row: int, column: int, joint_columns: Sequence[int]) -> str:
    person = table.rows[row][column].strip()
    if not person and any(table.rows[row][c].strip() not in ("", "0") for c in joint_columns):
        raise table.bad_cell(row, column, "a person's id, as the row has joints")
    return person


def _states(table: CsvTable, row: int, columns: Sequence[int]) -> list[float]:
    """The states of a row; an empty cell is NOT_TRACKED."""
    states = [0.0 if state != state else state for state in table.numbers(row, columns)]
    for column, state in zip(columns, states, strict=True):
        if state not in STATES:
            raise table.bad_cell(row, column, "0 (not tracked), 1 (inferred) or 2 (tracked)")
    return states


def write(path: Path, recording: Recording) -> None:
    """Write a recording, compressed if the name ends in ``.gz``; positions to the micrometre.

    The same recording always gives the same bytes.

    Raises:
        InputError: If the file cannot be written.
    """
    text = io.StringIO()
    for comment in [*recording.comments, f"{TIME_ZERO} {_seconds(recording.time_zero_ns)}"]:
        text.write(f"# {comment}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    frames = sorted(
        (int(stream.host_time_ns[frame]), number, frame)
        for number, stream in enumerate(recording.streams)
        for frame in range(len(stream))
    )
    for _, number, frame in frames:
        writer.writerows(_frame_rows(recording.streams[number], frame))
    data = text.getvalue().encode()
    with writing(path):
        path.write_bytes(gzip.compress(data, mtime=0) if path.suffix == ".gz" else data)


def _frame_rows(stream: SensorStream, frame: int) -> list[list[str]]:
    sensor_time = ""
    if stream.sensor_time_ns is not None:
        sensor_time = _seconds(int(stream.sensor_time_ns[frame]))
    begin = [stream.name, _seconds(int(stream.host_time_ns[frame])), sensor_time]
    rows = [
        [
            *begin,
            stream.person[row],
            *_joint_cells(stream.positions[row], stream.tracking_state[row]),
        ]
        for row in stream.rows(frame)
    ]
    return rows or [begin + [""] * (len(COLUMNS) - len(begin))]


def _joint_cells(positions: FloatArray, states: ByteArray) -> Iterator[str]:
    for position, state in zip(positions.tolist(), states.tolist(), strict=True):
        yield from (f"{value:.6f}" if state else "" for value in position)
        yield str(state)


def _seconds(time_ns: int) -> str:
    return f"{Decimal(time_ns).scaleb(-9):.9f}"


FORMAT = Format(key_columns=frozenset({"sensor", "host_time_s"}), read=read)
