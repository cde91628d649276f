"""A serial port (device, socket or RFC 2217 server), read in a thread."""

import math
import os
import queue
import threading
import time
from collections.abc import Callable
from enum import Enum

import serial
from serial.tools import list_ports

from imu_bridge.pipeline import Chunk
from pose_core.counters import Counters
from pose_core.errors import InputError

READ_BYTES = 65536
QUEUE_CHUNKS = 4096  # [-] about 40 s of the default read period
FIRST_BACKOFF_S = 0.1
LAST_BACKOFF_S = 2.0


class PortState(Enum):
    """State of the port."""

    WAITING = "waiting for the port"
    OPEN = "open"
    LOST = "lost, trying to reopen"
    FAILED = "failed"
    CLOSED = "closed"


class SerialSource:
    """Reads a port in stamped chunks; reopens a lost port.

    Args:
        port: Device path or pyserial URL (``socket://``, ``rfc2217://``, ``loop://``, …).
        baudrate: [bit/s]; ignored for pseudo-terminals and sockets.
        clock: The host's time [ns]; called in the reading thread.
        notify: Called in the reading thread when chunks are waiting or the state has changed.
        wait_s: Time to wait for a missing port [s].
        read_period_s: Duration for which bytes are collected into a chunk [s].
        index: Index of the port, copied to the chunks.

    Attributes:
        name: The port.
        counters: ``bytes``; ``port_losses``; ``chunks_dropped``: dropped because the
            queue was full.

    Raises:
        InputError: If the port cannot be opened and ``wait_s`` is 0.
    """

    def __init__(
        self,
        port: str,
        baudrate: int,
        *,
        clock: Callable[[], int],
        notify: Callable[[], None],
        wait_s: float = 0.0,
        read_period_s: float = 0.01,
        index: int = 0,
    ) -> None:
        self.counters = Counters("bytes", "port_losses", "chunks_dropped")
        self.state = PortState.WAITING
        self.error: InputError | None = None
        self.name = port
        self._index = index
        self._baudrate = baudrate
        self._clock = clock
        self._notify = notify
        self._read_period_s = read_period_s
        self._chunks: queue.Queue[Chunk] = queue.Queue(QUEUE_CHUNKS)
        self._stopping = threading.Event()
        serial_port = self._open() if wait_s <= 0.0 else None
        self._thread = threading.Thread(
            target=self._run, args=(serial_port, wait_s), name="serial", daemon=True
        )
        self._thread.start()

    def take(self) -> list[Chunk]:
        """Remove and return the queued chunks, in order of arrival.

        Raises:
            InputError: If the port did not appear within ``wait_s``.
        """
        if self.error is not None:
            raise self.error
        chunks = []
        while not self._chunks.empty():
            chunks.append(self._chunks.get_nowait())
        return chunks

    def close(self) -> None:
        """Stop reading; the thread ends within its read period."""
        self._stopping.set()
        self._thread.join()

    def _run(self, port: serial.SerialBase | None, wait_s: float) -> None:
        if port is None:
            port = self._open_in_time(wait_s)
        while port is not None:
            self._read(port)
            port = self._open_in_time(math.inf)
        if self.state is not PortState.FAILED:
            self.state = PortState.CLOSED

    def _read(self, port: serial.SerialBase) -> None:
        """Read until the port is lost or :meth:`close` is called."""
        self.state = PortState.OPEN
        self._notify()
        with port:
            while not self._stopping.is_set():
                try:
                    data = port.read(READ_BYTES)
                except (serial.SerialException, OSError):
                    self.counters.add("port_losses")
                    self.state = PortState.LOST
                    self._put(b"")
                    return
                if data:
                    self.counters.add("bytes", len(data))
                    self._put(data)

    def _put(self, data: bytes) -> None:
        try:
            self._chunks.put_nowait(Chunk(arrival_ns=self._clock(), data=data, port=self._index))
        except queue.Full:
            self.counters.add("chunks_dropped")
        self._notify()

    def _open_in_time(self, wait_s: float) -> serial.SerialBase | None:
        """Try, with growing intervals, to open the port, until ``wait_s`` or :meth:`close`."""
        deadline = time.monotonic() + wait_s
        backoff_s = FIRST_BACKOFF_S
        while not self._stopping.is_set():
            try:
                return self._open()
            except InputError as error:
                left_s = deadline - time.monotonic()
                if left_s <= 0.0:
                    self.error = InputError(f"{error} (waited {wait_s:g} s)")
                    self.state = PortState.FAILED
                    self._notify()
                    return None
            self._stopping.wait(min(backoff_s, left_s))
            backoff_s = min(2.0 * backoff_s, LAST_BACKOFF_S)
        return None

    def _open(self) -> serial.SerialBase:
        try:
            # Two readers would each get half the bytes: open the port exclusively.
            return serial.serial_for_url(
                self.name, self._baudrate, timeout=self._read_period_s, exclusive=True
            )
        except (serial.SerialException, OSError, ValueError) as error:
            number = getattr(error, "errno", None)
            reason = os.strerror(number) if number else " ".join(str(error).split())
            found = ", ".join(sorted(p.device for p in list_ports.comports())) or "none"
            raise InputError(
                f"cannot open port '{self.name}': {reason}; ports found: {found}; "
                "plug it in, or name another port"
            ) from error
