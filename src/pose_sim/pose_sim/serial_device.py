"""A virtual serial device: frames are written to a pseudo-terminal in real time.

Like a UART it has no flow control: bytes that are not read in time are lost and counted.
"""

import errno
import fcntl
import os
import re
import struct
import termios
import time
import tty
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_io.arrays import IntArray
from pose_sim import uart

INPUT_SPEED = 4  # index into the result of tcgetattr
SPEEDS = {
    code: int(name[1:]) for name, code in vars(termios).items() if re.fullmatch(r"B[1-9]\d+", name)
}
"""[bit/s] by the terminal's code for it."""
BATCH_NS = 4_000_000  # [ns] frames due within this are sent together, after the last of them
NAP_S = 0.1  # [s] largest delay until a request to stop is handled
SETTLE_S = 0.03  # [s] until written bytes are available to the reader
DRAIN_S = 0.5  # [s] for a reader to read the last bytes


@dataclass(frozen=True, kw_only=True)
class Transmission:
    """Frames sent by radio, in order of time."""

    due_ns: IntArray  # (n,) [ns]
    frames: tuple[bytes, ...]
    lost: int = 0
    corrupted: int = 0


def over_the_air(
    due_ns: IntArray,
    frames: Iterable[bytes],
    *,
    lost: float,
    corrupted: float,
    jitter_s: float,
    rng: np.random.Generator,
) -> Transmission:
    """Simulate a radio link that loses, corrupts and delays frames.

    Args:
        due_ns: Time of arrival of each frame without errors [ns], increasing.
        frames: The frames.
        lost: Share of frames that are lost.
        corrupted: Share of frames that arrive with a wrong byte.
        jitter_s: Mean of a further delay [s]; frames keep their order.
        rng: Random generator.
    """
    count = len(due_ns)
    arrives = rng.random(count) >= lost
    garbled = (rng.random(count) < corrupted) & arrives
    late = np.round(rng.exponential(1.0, count) * jitter_s * NS_PER_S).astype(np.int64)
    sent = list(frames)
    for index in np.flatnonzero(garbled):
        damaged = bytearray(sent[index])
        damaged[int(rng.integers(len(damaged)))] ^= int(rng.integers(1, 256))
        sent[index] = bytes(damaged)
    return Transmission(
        due_ns=np.maximum.accumulate(due_ns + late)[arrives],
        frames=tuple(sent[index] for index in np.flatnonzero(arrives)),
        lost=int(count - arrives.sum()),
        corrupted=int(garbled.sum()),
    )


class PseudoTerminal:
    """A pseudo-terminal in raw mode, its slave found under a link of a chosen name.

    Args:
        link: Symbolic link to create. A link of an earlier device is replaced.
        baudrate: Speed of the device [bit/s]: at another speed the reader receives the bytes that
            its UART would decode. None accepts any speed.

    Attributes:
        counters: ``bytes_written``, and ``bytes_unread``: lost because they were not read in time.

    Raises:
        InputError: If another file is at the link's path, or the link cannot be created.
    """

    def __init__(self, link: Path, baudrate: int | None = None) -> None:
        self._baudrate = baudrate
        self.counters = Counters("bytes_written", "bytes_unread")
        self.link = link
        stale = link.is_symlink() and str(os.readlink(link)).startswith("/dev/pts/")
        if (link.exists() or link.is_symlink()) and not stale:
            raise InputError(f"{link} exists and is not a virtual device: name another link")
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.device = os.ttyname(self._slave)
        temporary = link.with_name(f".{link.name}.{os.getpid()}")
        try:
            os.symlink(self.device, temporary)
            os.replace(temporary, link)  # atomic: the link always exists for readers
        except OSError as error:
            os.close(self._master)
            os.close(self._slave)
            raise InputError(f"cannot make the link {link}: {error.strerror}") from error

    def write(self, data: bytes) -> None:
        """Send bytes; those beyond the terminal's buffer are lost."""
        written = 0
        if self._baudrate is not None:
            reader = SPEEDS.get(termios.tcgetattr(self._slave)[INPUT_SPEED], self._baudrate)
            data = uart.received(data, self._baudrate, reader)
        try:
            written = os.write(self._master, data)
        except BlockingIOError:
            pass
        except OSError as error:
            if error.errno != errno.EIO:
                raise
        self.counters.add("bytes_written", written)
        self.counters.add("bytes_unread", len(data) - written)

    def unread(self) -> int:
        """Number of bytes not read yet."""
        answer = fcntl.ioctl(self._slave, termios.FIONREAD, struct.pack("i", 0))
        return int(struct.unpack("i", answer)[0])

    def close(self) -> None:
        """Remove the link and the terminal; unread bytes are lost."""
        self.counters.add("bytes_unread", self.unread())
        if self.link.is_symlink() and os.readlink(self.link) == self.device:
            self.link.unlink()
        os.close(self._slave)
        os.close(self._master)


@dataclass(frozen=True, kw_only=True)
class Sent:
    """Result of a transmission."""

    sent: int  # [frames]
    skipped: int  # [frames] due before the device was started
    finished: bool  # whether all frames were sent, without a request to stop


def transmit(
    terminal: PseudoTerminal,
    transmission: Transmission,
    start_ns: int,
    *,
    stopped: Callable[[], bool],
    clock: Callable[[], int] = time.time_ns,
    sleep: Callable[[float], None] = time.sleep,
) -> Sent:
    """Send every frame at its time; frames already due at the start are skipped.

    Args:
        terminal: The terminal to write to.
        transmission: The frames with their times.
        start_ns: Host time [ns] of the transmission's time zero.
        stopped: Whether to stop; asked between batches.
        clock: Function that returns the host's time [ns].
        sleep: Function that waits for a time [s].
    """
    first = int(np.searchsorted(transmission.due_ns, clock() - start_ns - BATCH_NS))
    sent = 0
    for begin, end in _batches(transmission.due_ns, first):
        due_ns = start_ns + int(transmission.due_ns[end - 1])
        while not stopped() and (wait_ns := due_ns - clock()) > 0:
            sleep(min(wait_ns / NS_PER_S, NAP_S))
        if stopped():
            return Sent(sent=sent, skipped=first, finished=False)
        terminal.write(b"".join(transmission.frames[begin:end]))
        sent += end - begin
    deadline_ns = clock() + int(DRAIN_S * NS_PER_S)
    sleep(SETTLE_S)
    while terminal.unread() and clock() < deadline_ns and not stopped():
        sleep(0.01)
    return Sent(sent=sent, skipped=first, finished=True)


def _batches(due_ns: IntArray, first: int) -> Iterator[tuple[int, int]]:
    begin = first
    while begin < len(due_ns):
        end = int(np.searchsorted(due_ns, due_ns[begin] + BATCH_NS, side="right"))
        yield begin, end
        begin = end
