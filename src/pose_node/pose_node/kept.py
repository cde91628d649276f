"""What a node keeps on disk while a graph runs: one that dies goes on with what it had found out.

Kept in ``$XDG_STATE_HOME/pose_fusion`` (``~/.local/state``), readable by the owner alone, by node,
ROS domain and run; what an earlier run has left goes with the first look of the next.
"""

import os
import re
from contextlib import suppress
from pathlib import Path

from pose_core.errors import InputError
from pose_core.plain_yaml import dump_yaml, read_yaml
from pose_core.private_file import write_private

FOLDER = "pose_fusion"


def kept_file(node: str, run: str) -> Path | None:
    """Where a node keeps what it knows; other runs' files are removed.

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
        for pattern in (f"{prefix}*.yaml", f"person-{prefix}*.yaml"):
            for old in folder.glob(pattern):
                if not old.name.endswith(path.name):
                    old.unlink(missing_ok=True)
    except OSError:
        return None  # a read-only home: the node works, and begins anew after a death
    return path


class KeptPerson:
    """The id of the person whom somebody has chosen while a node runs.

    Args:
        beside: The node's file; None: nothing is kept.
    """

    def __init__(self, beside: Path | None) -> None:
        self._path = None if beside is None else beside.with_name(f"person-{beside.name}")

    def load(self) -> str:
        """The id; empty if nobody has been chosen."""
        if self._path is None or not self._path.exists():
            return ""
        try:
            person = read_yaml(self._path, "the chosen person")
        except InputError:
            return ""
        return person if isinstance(person, str) else ""

    def save(self, person: str) -> None:
        """Keep the id."""
        if self._path is not None:
            with suppress(InputError):
                write_private(self._path, dump_yaml(person), "the chosen person")
