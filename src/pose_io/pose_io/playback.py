"""Playback of a bag in real time: which messages are due, at any rate, with pauses.

Positions are times of the recording [ns]; ``now_ns`` is any steady clock of the caller.
"""

from collections.abc import Collection, Iterator

from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_io.bags import BagMessage, BagReader


class PlaybackClock:
    """Maps a steady clock to the position in a recording.

    Args:
        position_ns: Initial position [ns].
        rate: Playback speed relative to the recording's.
        paused: Whether to wait for :meth:`resume` first.
    """

    def __init__(self, position_ns: int, rate: float, *, paused: bool, now_ns: int) -> None:
        self._position_ns = position_ns
        self._rate = rate
        self._since_ns = None if paused else now_ns

    @property
    def paused(self) -> bool:
        """Whether playback is paused."""
        return self._since_ns is None

    def position_ns(self, now_ns: int) -> int:
        """The position [ns] at ``now_ns``."""
        if self._since_ns is None:
            return self._position_ns
        return self._position_ns + round((now_ns - self._since_ns) * self._rate)

    def pause(self, now_ns: int) -> None:
        """Pause at the current position."""
        self._position_ns = self.position_ns(now_ns)
        self._since_ns = None

    def resume(self, now_ns: int) -> None:
        """Continue from the current position."""
        if self._since_ns is None:
            self._since_ns = now_ns

    def change_rate(self, rate: float, now_ns: int) -> None:
        """Continue from the current position at another rate."""
        self.jump(self.position_ns(now_ns), now_ns)
        self._rate = rate

    def jump(self, position_ns: int, now_ns: int) -> None:
        """Continue from another position at the same rate."""
        self._position_ns = position_ns
        if self._since_ns is not None:
            self._since_ns = now_ns

    def wait_ns(self, position_ns: int, now_ns: int) -> int:
        """Time [ns] until a position is reached, at least 0; computed without regard to a pause."""
        return max(0, round((position_ns - self.position_ns(now_ns)) / self._rate))


class Playlist:
    """The messages of a bag from a position on, in order.

    Args:
        bag: The open bag.
        topics: The topics to play; all if empty.
        start_offset_s: Start of playback after the bag's first message [s].

    Raises:
        InputError: If a topic is not in the bag, or the start is after its end.
    """

    def __init__(
        self, bag: BagReader, topics: Collection[str] = (), start_offset_s: float = 0.0
    ) -> None:
        missing = sorted(set(topics) - set(bag.topics))
        if missing:
            raise InputError(
                f"{bag.path} holds no topic {', '.join(missing)}: it has {', '.join(bag.topics)}"
            )
        self.topics = [topic for topic in bag.topics.values() if not topics or topic.name in topics]
        self.end_ns = bag.end_ns
        self._bag = bag
        self.start_from(start_offset_s)
        self._messages: Iterator[BagMessage] = iter(())
        self._next: BagMessage | None = None

    def start_from(self, offset_s: float) -> None:
        """Set the start [s] after the bag's first message, used from the next :meth:`rewind` on.

        Raises:
            InputError: If that is after its end.
        """
        if offset_s > self._bag.duration_s:
            raise InputError(
                f"start_offset = {offset_s} s is after the end of {self._bag.path}"
                f" ({self._bag.duration_s:.3f} s)"
            )
        self.start_ns = self._bag.start_ns + round(offset_s * NS_PER_S)

    def rewind(self) -> list[BagMessage]:
        """Return to the start; returns the last messages of latched topics before it."""
        latched = {topic.name for topic in self.topics if topic.latched}
        self._messages = self._bag.messages({topic.name for topic in self.topics})
        before = []
        for message in self._messages:
            if message.stamp_ns >= self.start_ns:
                self._next = message
                break
            if message.topic in latched:
                before.append(message)
        else:
            self._next = None
        return before

    @property
    def next_ns(self) -> int | None:
        """The position [ns] of the next message, None at the end."""
        return None if self._next is None else self._next.stamp_ns

    def due(self, position_ns: int) -> Iterator[BagMessage]:
        """Remove and yield the messages up to a position [ns]."""
        while self._next is not None and self._next.stamp_ns <= position_ns:
            message, self._next = self._next, next(self._messages, None)
            yield message
