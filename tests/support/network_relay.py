"""A network between namespaces that delays or drops each host's frames.

Each host is a network namespace with a TAP device; this process holds the other ends, as a switch
does. It stands in for ``tc netem``, which many kernels have not. Commands come on stdin, one a
line, answers go to stdout::

    delay MS JITTER_MS      of every frame from now on, uniform within ± the jitter
    loss PERCENT            of all frames
    cut HOST, mend HOST     nothing to or from that host
    bytes                   what each host has sent, as JSON
"""

import ctypes
import fcntl
import heapq
import json
import os
import random
import selectors
import struct
import sys
import time

TUNSETIFF, IFF_TAP, IFF_NO_PI = 0x400454CA, 0x0002, 0x1000
CLONE_NEWNET = 0x40000000
FRAME_BYTES = 65536
MS = 1e-3

_libc = ctypes.CDLL(None, use_errno=True)


def enter(namespace: int) -> None:
    """Go into a network namespace by its open file."""
    if _libc.setns(namespace, CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), "cannot enter the namespace")


def open_tap(name: str) -> int:
    """A TAP device in the namespace that we are in; it lives as long as this process."""
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    flags = IFF_TAP | IFF_NO_PI
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH14x", name.encode(), flags))
    return device


class Relay:
    """The switch.

    Args:
        namespaces: Name of each host's namespace by the host's name.
    """

    def __init__(self, namespaces: dict[str, str]) -> None:
        home = os.open("/proc/self/ns/net", os.O_RDONLY)
        self.devices: dict[str, int] = {}
        for host, namespace in namespaces.items():
            there = os.open(f"/run/netns/{namespace}", os.O_RDONLY)
            enter(there)
            self.devices[host] = open_tap("tap0")
            enter(home)
            os.close(there)
        self.hosts = {device: host for host, device in self.devices.items()}
        self.sent = dict.fromkeys(namespaces, 0)  # [bytes]
        self.delay_s, self.jitter_s, self.loss = 0.0, 0.0, 0.0
        self.down: set[str] = set()
        self._random = random.Random(20)
        self._count = 0
        self._due: list[tuple[float, int, int, bytes]] = []
        self._places: dict[bytes, int] = {}  # device by the address that was heard on it

    def command(self, words: list[str]) -> str:
        """Carry a command out; the answer."""
        verb, *rest = words
        if verb == "delay":
            self.delay_s, self.jitter_s = float(rest[0]) * MS, float(rest[1]) * MS
        elif verb == "loss":
            self.loss = float(rest[0]) / 100.0
        elif verb == "cut":
            self.down.add(rest[0])
        elif verb == "mend":
            self.down.discard(rest[0])
        elif verb == "bytes":
            return json.dumps(self.sent)
        else:
            return f"error: no command {verb}"
        return "ok"

    def take(self, device: int) -> None:
        """All frames that a host has sent."""
        host = self.hosts[device]
        while True:
            try:
                frame = os.read(device, FRAME_BYTES)
            except BlockingIOError:
                return
            self.sent[host] += len(frame)
            if host in self.down or (self.loss and self._random.random() < self.loss):
                continue
            self._places[frame[6:12]] = device
            target = self._places.get(frame[:6])
            jitter_s = self._random.uniform(-self.jitter_s, self.jitter_s)
            due = time.monotonic() + max(0.0, self.delay_s + jitter_s)
            for other in self.hosts if target is None else (target,):
                if other != device:
                    self._count += 1
                    heapq.heappush(self._due, (due, self._count, other, frame))

    def deliver(self) -> float | None:
        """Hand on what is due; how long until the next [s]."""
        while self._due:
            wait_s = self._due[0][0] - time.monotonic()
            if wait_s > 0.0:
                return wait_s
            _, _, device, frame = heapq.heappop(self._due)
            if self.hosts[device] not in self.down:
                try:
                    os.write(device, frame)
                except OSError:  # its queue is full, or it is not up yet
                    continue
        return None

    def run(self) -> None:
        """Until stdin ends."""
        selector = selectors.DefaultSelector()
        for device in self.hosts:
            selector.register(device, selectors.EVENT_READ)
        selector.register(sys.stdin, selectors.EVENT_READ)
        print("ready", flush=True)
        while True:
            for key, _ in selector.select(self.deliver()):
                if key.fileobj is not sys.stdin:
                    self.take(key.fd)
                    continue
                line = sys.stdin.readline()
                if not line:
                    return
                print(self.command(line.split()), flush=True)


if __name__ == "__main__":
    Relay(dict(word.split("=") for word in sys.argv[1:])).run()
