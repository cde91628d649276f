"""A finished run of the demo."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pose_node.node_status import NodeStatus


@dataclass(frozen=True, kw_only=True)
class DemoRun:
    """A finished run of the graph."""

    folder: Path
    subject: str  # description of the subject
    nodes: Mapping[str, NodeStatus]  # the last report of each node

    @property
    def bag(self) -> Path:
        """The recorded bag."""
        return self.folder / "bag"
