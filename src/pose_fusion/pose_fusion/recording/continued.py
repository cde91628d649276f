"""A recording in a series of bags: the next one follows at a limit, or when the disk has room."""

import shutil
import time
from collections import deque
from contextlib import suppress
from pathlib import Path

from rosbags.interfaces import Qos, QosDurability

from pose_core.errors import PoseError
from pose_fusion.recording.growing_bag import ExistsError, GrowingBag, free_path
from pose_fusion.recording.parameters import RecorderParameters

RETRY_S = 2.0  # [s] after which a recording that failed is continued in a new bag
LATCHED_KEPT = 50  # messages of a latched topic with which the next bag begins
BYTES_PER_MB = 1_000_000


class ContinuedRecording:
    """A series of bags: ``bag``, ``bag-2``, …, each complete by itself.

    A full disk, or a removed folder, ends a bag, not the recording: :attr:`trouble` gives the
    reason, and a new bag is tried. The current one is :attr:`bag`.

    Args:
        first: The series' first folder; bags that exist are kept, and followed by the next number.
        settings: Format, limits.

    Raises:
        InputError: If no folder can be made.
    """

    def __init__(self, first: Path, settings: RecorderParameters) -> None:
        self._first = first
        self._settings = settings
        self._least_free = int(settings.least_free_space * BYTES_PER_MB)
        self._topics: dict[str, tuple[str, list[Qos]]] = {}
        self._latched: dict[str, deque[bytes]] = {}
        self._newest_ns = 0
        self._retry_s = 0.0
        self._messages_before = 0
        self.trouble = ""
        self.bags = 1
        self.bag = self._begin()

    def _begin(self) -> GrowingBag:
        self._begun_s = time.monotonic()
        while True:
            path = free_path(self._first)
            with suppress(ExistsError):  # another recorder has made it at this moment
                return GrowingBag(path, self._settings.storage, least_free=self._least_free)

    @property
    def message_count(self) -> int:
        """Messages in all bags."""
        return self._messages_before + self.bag.message_count

    def add_topic(self, topic: str, msgtype: str, offered: list[Qos]) -> None:
        """Declare a topic, see :meth:`GrowingBag.add_topic`."""
        self.bag.add_topic(topic, msgtype, offered)
        self._topics[topic] = (msgtype, offered)
        if any(one.durability == QosDurability.TRANSIENT_LOCAL for one in offered):
            self._latched.setdefault(topic, deque(maxlen=LATCHED_KEPT))

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Append a message; nothing while there is trouble."""
        if topic in self._latched:
            self._latched[topic].append(data)
        self._newest_ns = stamp_ns
        if self.trouble:
            return
        try:
            self.bag.write(topic, data, stamp_ns)
        except PoseError as error:
            self._fail(error)

    def flush(self) -> None:
        """Complete on disk what has come so far; begin the next bag if it is time to."""
        if self.trouble:
            self._retry()
            return
        try:
            self.bag.flush()
            if self._is_long_enough():
                self._go_on()
        except PoseError as error:
            self._fail(error)

    def close(self) -> None:
        """Complete the last bag.

        Raises:
            RecordingError: If the disk cannot take the rest.
        """
        self.bag.close()

    def _is_long_enough(self) -> bool:
        size = self._settings.split_size * BYTES_PER_MB
        duration_s = self._settings.split_duration
        lasted_s = time.monotonic() - self._begun_s
        is_large, is_long = 0.0 < size < self.bag.size, 0.0 < duration_s < lasted_s
        return self.bag.message_count > 0 and (is_large or is_long)

    def _go_on(self) -> None:
        """Begin the next bag: all topics, and what latched ones said before."""
        self.bag.close()
        following = self._begin()  # may fail, and be tried again
        self._messages_before += self.bag.message_count
        self.bag = following
        self.bags += 1
        for topic, (msgtype, offered) in self._topics.items():
            self.bag.add_topic(topic, msgtype, offered)
            for data in self._latched.get(topic, ()):
                self.bag.write(topic, data, self._newest_ns)

    def _fail(self, error: PoseError) -> None:
        self.trouble = str(error)
        self._retry_s = time.monotonic() + RETRY_S

    def _retry(self) -> None:
        """Record again, once there is room."""
        if time.monotonic() < self._retry_s:
            return
        self._retry_s = time.monotonic() + RETRY_S
        try:
            self._first.parent.mkdir(parents=True, exist_ok=True)
            if shutil.disk_usage(self._first.parent).free <= self._least_free:
                return
            self._go_on()
        except (PoseError, OSError) as error:
            self.trouble = str(error)
        else:
            self.trouble = ""
