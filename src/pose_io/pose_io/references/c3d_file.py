"""C3D files (c3d.org), read by the library of that name."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from pose_core.errors import InputError, one_line
from pose_io.c3d_library import c3d_library
from pose_io.references.markers import MarkerSeries, metres_of, plain


def read_c3d(path: Path) -> MarkerSeries:
    """Read the points of a C3D file; those marked invalid by their residual are NaN.

    Raises:
        InputError: If it cannot be read, or holds no points.
    """
    c3d = c3d_library()
    try:
        with path.open("rb") as handle, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of analogue channels, which are not read
            reader = c3d.Reader(handle)
            labels = [plain(label) for label in reader.point_labels]
            rate = float(reader.point_rate)
            unit = _unit(reader)
            frames = [np.array(points[:, :4]) for _, points, _ in reader.read_frames(copy=False)]
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    except Exception as error:  # damaged bytes may raise any exception
        raise InputError(f"{path} is not a readable C3D file: {one_line(error)}") from error
    if not labels or not frames or not rate > 0.0:
        raise InputError(
            f"{path} holds {len(labels)} points and {len(frames)} frames at {rate:g} Hz"
        )
    points = np.stack(frames).astype(float)[:, : len(labels)]
    invalid = (points[..., 3] < 0.0) | ~points[..., :3].any(axis=2)
    positions = np.where(invalid[..., None], np.nan, metres_of(unit, path) * points[..., :3])
    return MarkerSeries(
        stamps_ns=np.round(1e9 * np.arange(len(frames)) / rate).astype(np.int64),
        positions={label: positions[:, index] for index, label in enumerate(labels)},
    )


def _unit(reader: Any) -> str:
    parameter = reader.get("POINT:UNITS")
    text = "" if parameter is None else str(parameter.string_value)
    return text.strip().lower() or "mm"  # c3d.org: millimetres if the file has no unit
