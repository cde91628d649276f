"""The session's file: extrinsics and clocks, and sections that other parts of the program keep.

One YAML file holds all that a session has found out: what :mod:`extrinsics_file` describes, and
sections by name, for example ``body`` (bone lengths) and ``imus`` (how each IMU is strapped on).
A section is a mapping; whoever owns it reads and checks its content.

.. code-block:: python

    save_section(path, "body", {"bone_lengths": {"left_thigh": 0.43}})
    body = load_section(path, "body")  # None if the file has no such section
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pose_calibration.files.extrinsics_file import OWN_KEYS, read_document, write_document
from pose_core.errors import InputError

PLAIN = (str, int, float, bool, type(None))


def load_section(path: Path, name: str) -> Mapping[str, Any] | None:
    """Read a section; None if the file has none of this name.

    Raises:
        InputError: If the file is no session, or the section no mapping.
    """
    content = read_document(path).get(_checked_name(name))
    if content is None:
        return None
    if not isinstance(content, Mapping):
        raise InputError(f"{path}: section '{name}' is {content!r}, expected a mapping")
    return content


def save_section(path: Path, name: str, content: Mapping[str, Any]) -> None:
    """Write a section into a session's file, which must exist; the rest of it stays.

    Args:
        path: The file.
        name: The section's name.
        content: Mappings, lists, texts and numbers only.

    Raises:
        InputError: If the file is no session, cannot be written, or the content is not plain.
    """
    _check_plain(name, content)
    document = dict(read_document(path))
    document[_checked_name(name)] = dict(content)
    write_document(path, document)


def _checked_name(name: str) -> str:
    if name in OWN_KEYS or not name.isidentifier():
        raise InputError(
            f"'{name}' cannot be a section: expected an identifier other than {', '.join(OWN_KEYS)}"
        )
    return name


def _check_plain(where: str, value: object) -> None:
    if isinstance(value, Mapping):
        for key, each in value.items():
            if not isinstance(key, str):
                raise InputError(f"section {where}: key {key!r} is no text")
            _check_plain(f"{where}/{key}", each)
    elif isinstance(value, list):
        for index, each in enumerate(value):
            _check_plain(f"{where}/{index}", each)
    elif type(value) not in PLAIN:
        raise InputError(
            f"section {where} holds a {type(value).__name__}: "
            "expected text, numbers, lists, mappings"
        )
