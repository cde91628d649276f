"""Interface of the sources of skeletons, and the table of them."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pose_core.arrays import FloatArray
from pose_io.arrays import ByteArray
from pose_node.node_status import Report

SOURCES = {
    "file": "recording.RecordingSource",
    "markers": "markers.MarkersSource",
    "zed": "zed.ZedSource",
    "hiros": "hiros.HirosSource",
    "named_poses": "named_poses.NamedPosesSource",
    "tf": "tf.TfSource",
    "udp": "udp.UdpSource",
    "nite2": "nite2.Nite2Source",
}
"""Module in ``sources`` and class of each source; only the selected one is imported."""


@dataclass(frozen=True, kw_only=True)
class SkeletonFrame:
    """All p persons measured by a sensor at one instant."""

    stamp_ns: int  # [ns] capture on the host's clock
    person: tuple[str, ...]  # p ids
    positions: FloatArray  # (p, 15, 3) [m] in the sensor's optical frame; NaN where not tracked
    tracking_state: ByteArray  # (p, 15), values of TrackingState


@dataclass(frozen=True, kw_only=True)
class SourceTopic:
    """A topic to which a source subscribes."""

    name: str
    type_name: str  # "package/msg/Type", resolved when the node starts
    depth: int = 5
    latched: bool = False  # transient local: late subscribers receive the newest message


class SkeletonSource(ABC):
    """A source of skeletons for the node.

    It is made from the node's parameters, and raises a PoseError if one of them is invalid, a
    library is missing or a port in use. All methods are called from the node's thread; other
    threads signal new frames by ``wake``.

    Attributes:
        hardware_id: The device or file, for ``/diagnostics``.
        topics: Topics to subscribe to; each message is passed to :meth:`receive`.
    """

    hardware_id: str
    topics: tuple[SourceTopic, ...] = ()

    @property
    def is_finished(self) -> bool:
        """Whether the source has ended."""
        return False

    @abstractmethod
    def start(self, now_ns: Callable[[], int], wake: Callable[[], None]) -> None:
        """Start the source.

        Args:
            now_ns: Returns the host's time [ns]; may be called from any thread.
            wake: Makes the node call :meth:`take` soon; may be called from any thread.
        """

    def receive(self, message: Any, topic: str) -> None:  # noqa: B027 (without topics: none come)
        """Process a message of one of :attr:`topics`."""

    @abstractmethod
    def take(self) -> SkeletonFrame | None:
        """The next frame, if one is due."""

    def wait_ns(self) -> int | None:
        """Time until the next call of :meth:`take` [ns]; None: not before ``wake``."""
        return None

    @abstractmethod
    def report(self) -> Report:
        """The state, called once per second."""

    def close(self) -> None:  # noqa: B027 (some hold nothing)
        """Stop, and release devices and threads."""
