"""Messages of the graph received while a session was replayed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_node.node_status import NodeStatus


@dataclass(frozen=True, kw_only=True)
class Poses:
    """n messages of one topic."""

    stamps_ns: NDArray[np.int64]  # (n,)
    arrived_ns: NDArray[np.int64]  # (n,)
    values: FloatArray  # (n, joints) [rad], or (n, 15, 3) [m]

    def between(self, begin_ns: int, end_ns: int) -> "Poses":
        """The messages that arrived in an interval [ns]."""
        rows = (self.arrived_ns >= begin_ns) & (self.arrived_ns < end_ns)
        return Poses(
            stamps_ns=self.stamps_ns[rows],
            arrived_ns=self.arrived_ns[rows],
            values=self.values[rows],
        )


@dataclass(frozen=True, kw_only=True)
class Heard:
    """All received messages."""

    joints: Poses
    bodies: Poses
    said: Sequence[NodeStatus]
