"""Errors that a user can correct: each says what was found, what was expected, what to do."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class PoseError(Exception):
    """An error that the user can correct; the message is one complete line."""


class ParameterError(PoseError):
    """A parameter is unknown, of the wrong type or outside its range."""


class InputError(PoseError):
    """A file, a device or a stream is missing or invalid."""


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Context manager around code that writes a file or a folder.

    Raises:
        InputError: If it cannot be written.
    """
    try:
        yield
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from error


def one_line(error: BaseException) -> str:
    """First line of any exception's message, or its type if the message is empty."""
    text = str(error).strip().splitlines()
    return text[0].rstrip(".") if text else type(error).__name__
