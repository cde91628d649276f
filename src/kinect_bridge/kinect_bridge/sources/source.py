"""What a source of skeletons is, for the node: frames with stamps, whoever made them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from pose_io.recordings.joint_maps import FloatArray, StateArray
from pose_node.level import Level


@dataclass(frozen=True, kw_only=True)
class SkeletonFrame:
    """Everybody a sensor saw at one instant; p people, none if it saw nobody."""

    stamp_ns: int  # [ns] capture on the host's clock
    person: tuple[str, ...]  # p ids
    positions: FloatArray  # (p, 15, 3) [m] in the sensor's optical frame; NaN where not tracked
    tracking_state: StateArray  # (p, 15), values of TrackingState


@dataclass(frozen=True, kw_only=True)
class SourceReport:
    """How a source does: a sentence, and counts by reason."""

    level: Level
    message: str
    values: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Topic:
    """A topic that a source wants to hear."""

    name: str
    type_name: str  # "package/msg/Type", resolved when the node starts
    install: str = ""  # how to get the package, for people
    depth: int = 5
    latched: bool = False  # its publishers keep the newest message for late subscribers


class SkeletonSource(Protocol):
    """Where a bridge's skeletons come from.

    The node calls everything from its own thread; what a source does in others ends in ``wake``.

    Attributes:
        hardware_id: The device or file, for ``/diagnostics``.
        topics: What the node is to subscribe to, handing each message to :meth:`receive`.
    """

    hardware_id: str
    topics: tuple[Topic, ...]

    @property
    def is_finished(self) -> bool:
        """Whether nothing will come any more."""

    def start(self, now_ns: Callable[[], int], wake: Callable[[], None]) -> None:
        """Begin.

        Args:
            now_ns: The host's clock [ns], from any thread.
            wake: Has the node call :meth:`take` soon, from any thread.
        """

    def receive(self, message: Any, topic: str) -> None:
        """Take a message of one of :attr:`topics`."""

    def take(self) -> SkeletonFrame | None:
        """The next frame, if one is due."""

    def wait_ns(self) -> int | None:
        """How long until the next :meth:`take` is worth it [ns]; None: not before a wake."""

    def report(self) -> SourceReport:
        """The state, once a second."""

    def close(self) -> None:
        """End, and let go of devices and threads."""
