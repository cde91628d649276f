"""TRC files: labelled points of OpenSim and of motion-analysis systems."""

from pathlib import Path

import numpy as np

from pose_core.errors import InputError
from pose_io.references.markers import MarkerSeries, metres_of, plain
from pose_io.references.reference import numbers_of, padded_table, text_of

HEADER_LINES = 5  # file type, names, values, labels, X1 Y1 Z1 …


def read_trc(path: Path) -> MarkerSeries:
    """Read a TRC file.

    Raises:
        InputError: If it is not a TRC file.
    """
    lines = text_of(path).splitlines()
    if len(lines) <= HEADER_LINES or not lines[0].startswith("PathFileType"):
        raise InputError(f"{path} is not a TRC file: expected 'PathFileType' and five header lines")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    metres = metres_of(header.get("Units", "").strip().lower(), path)
    labels = [label.strip() for label in lines[3].rstrip().split("\t")[2:]][::3]
    rows = [
        numbers_of(path, number, line.rstrip("\r\n").split("\t"))
        for number, line in enumerate(lines[HEADER_LINES:], HEADER_LINES + 1)
        if line.strip()
    ]
    width = 2 + 3 * len(labels)
    if not labels or not rows:
        raise InputError(f"{path} holds {len(labels)} labels and {len(rows)} frames")
    table = padded_table(rows, width)
    points = metres * table[:, 2:].reshape(len(rows), len(labels), 3)
    return MarkerSeries(
        stamps_ns=np.round(1e9 * table[:, 1]).astype(np.int64),
        positions={plain(label): points[:, index] for index, label in enumerate(labels) if label},
    )
