"""State that a node saves while a graph runs, to continue with it after a crash.

Kept in ``$XDG_STATE_HOME/pose_fusion`` (``~/.local/state``), readable by the owner alone, by node,
ROS domain and run; the first reading in a run removes files of earlier runs.
"""

import json
import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Generic, TypeVar

from pose_core.atomic_file import write_atomically
from pose_core.errors import InputError

FOLDER = "pose_fusion"
T = TypeVar("T")


def kept_file(node: str, run: str) -> Path | None:
    """The file of a node's saved state; files of other runs are removed.

    Args:
        node: Its fully qualified name.
        run: The graph's run, from its launch file; empty: nothing is kept.

    Returns:
        The file, which may not exist yet; None if nothing is kept, or nowhere can be written.
    """
    if not run:
        return None
    base = os.environ.get("XDG_STATE_HOME") or "~/.local/state"
    folder = Path(base).expanduser() / FOLDER
    name = re.sub(r"\W+", "_", node).strip("_")
    prefix = f"{name}-{os.environ.get('ROS_DOMAIN_ID', '0')}-"
    path = folder / f"{prefix}{run}.yaml"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for pattern in (f"{prefix}*", f"*-{prefix}*"):
            for old in folder.glob(pattern):
                if not old.stem.endswith(path.stem):
                    old.unlink(missing_ok=True)
    except OSError:
        return None  # a read-only home: the node works, but restarts from nothing after a crash
    return path


class Kept(Generic[T]):
    """A value that a node saves while a graph runs.

    Args:
        beside: The node's file; None: nothing is kept.
        name: Of the value.
        read: Makes the value of plain mappings, lists, texts and numbers; an
            :class:`InputError` says that it cannot.
    """

    def __init__(self, beside: Path | None, name: str, read: Callable[[Any], T]) -> None:
        self._path = None if beside is None else beside.with_name(f"{name}-{beside.stem}.json")
        self._read = read

    def load(self) -> T | None:
        """Load the value; None if there is none that can be read."""
        if self._path is None:
            return None
        try:
            return self._read(json.loads(self._path.read_bytes()))
        except (OSError, ValueError, InputError):
            return None

    def save(self, plain: Any) -> None:
        """Save plain mappings, lists, texts and numbers, without waiting for the disk."""
        if self._path is not None:
            with suppress(InputError):
                data = json.dumps(plain).encode()
                write_atomically(self._path, data, "the state", is_synced=False)
