"""Tables of numbers in text files, without a header."""

import io
from pathlib import Path

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.errors import InputError, one_line
from pose_io.recordings.formats.file_content import MAX_TABLE_BYTES, read_content


def read_numbers(path: Path, columns: int, meaning: str) -> FloatArray:
    """Read numbers separated by commas, plain or gzip.

    Args:
        path: The file.
        columns: Expected number of columns.
        meaning: Description of the columns, for the error message.

    Returns:
        The numbers, shape (n, columns), n at least 1.

    Raises:
        InputError: If the file is missing, or is not such a table.
    """
    if not path.is_file():
        raise InputError(f"found no file {path}: expected {meaning}")
    try:
        text = read_content(path, MAX_TABLE_BYTES).decode("latin-1")
        numbers = np.loadtxt(io.StringIO(text), delimiter=",", ndmin=2)
    except ValueError as error:
        raise InputError(f"{path} is not a table of numbers: {one_line(error)}") from error
    found = numbers.shape[1] if numbers.size else 0
    if found != columns:
        raise InputError(f"{path} has {found} columns, expected {columns}: {meaning}")
    return numbers.astype(np.float64)
