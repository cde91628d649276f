"""CSV files as Vicon Nexus exports them: the section ``Trajectories``.

.. code-block:: text

    Trajectories
    100
    ,,subject:LASI,,,subject:RASI,,
    Frame,Sub Frame,X,Y,Z,X,Y,Z
    ,,mm,mm,mm,mm,mm,mm
    1,0,512.3,…
"""

import csv
from pathlib import Path

import numpy as np

from pose_core.errors import InputError
from pose_io.references.markers import MarkerSeries, metres_of, plain
from pose_io.references.reference import numbers_of, padded_table, text_of

SECTION = "trajectories"
MAX_FRAME = 2**40  # [-] years of frames
HEADER_LINES = 5  # name, rate, labels, axes, units


def read_vicon_csv(path: Path) -> MarkerSeries:
    """Read the trajectories of a Nexus export; other sections are left out.

    Raises:
        InputError: If it holds none.
    """
    text = text_of(path)
    first = next((n for n, line in enumerate(text.splitlines()) if _cell(line) == SECTION), None)
    if first is None:
        raise InputError(
            f"{path} is not a Vicon CSV: expected a section 'Trajectories' as Nexus exports it"
        )
    delimiter = max(",;\t", key=text.count)
    rows = list(csv.reader(text.splitlines()[first:], delimiter=delimiter))
    if len(rows) <= HEADER_LINES:
        raise InputError(f"{path}: its section 'Trajectories' holds no frames")
    (rate,) = numbers_of(path, first + 2, rows[1][:1]) or (np.nan,)
    if not rate > 0.0:
        raise InputError(f"{path}, line {first + 2}: the rate is {rate:g} Hz, expected more than 0")
    body: list[list[float]] = []
    for number, row in enumerate(rows[HEADER_LINES:], first + HEADER_LINES + 1):
        if not row or not row[0].strip():
            break  # an empty line ends the section
        body.append(numbers_of(path, number, row))
    return _series(path, rows, body, rate)


def _series(
    path: Path, rows: list[list[str]], body: list[list[float]], rate: float
) -> MarkerSeries:
    axes = [cell.strip().lower() for cell in rows[3]]
    units = [cell.strip().lower() for cell in rows[4]] + [""] * len(rows[2])
    columns = {
        plain(cell): k
        for k, cell in enumerate(rows[2])
        if plain(cell) and axes[k : k + 3] == ["x", "y", "z"]
    }
    if not columns or not body:
        raise InputError(f"{path} holds {len(columns)} labels and {len(body)} frames")
    table = padded_table(body, max(columns.values()) + 3)
    if not (np.abs(table[:, 0]) < MAX_FRAME).all():  # nor a NaN
        raise InputError(f"{path}: a frame number is invalid: expected increasing integers")
    frames = table[:, 0] - table[0, 0]
    return MarkerSeries(
        stamps_ns=np.round(1e9 * frames / rate).astype(np.int64),
        positions={
            label: metres_of(units[index], path) * table[:, index : index + 3]
            for label, index in columns.items()
        },
    )


def _cell(line: str) -> str:
    """The first cell of a line, small."""
    return line.replace(";", ",").replace("\t", ",").split(",")[0].strip().strip('"').lower()
