"""Several computers on this one: network namespaces, and what lies between them.

``make_hosts(("left", "right", "fusion"))`` is a context; without the right to make namespaces the
test is skipped, with the reason.
"""

import contextlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

RELAY = Path(__file__).with_name("network_relay.py")
SUBNET = "10.77.0"


class Hosts:
    """Network namespaces with one address each, joined by a relay.

    Args:
        names: The hosts.
        relay: The process between them.
    """

    def __init__(self, names: Sequence[str], relay: "subprocess.Popen[str]") -> None:
        self._relay = relay
        self.addresses = {name: f"{SUBNET}.{k}" for k, name in enumerate(names, 1)}

    def command(self, host: str, command: Sequence[str | Path]) -> list[str]:
        """A command as it runs on a host, whose shared memory is its own."""
        inside = ("ip", "netns", "exec", namespace_of(host))
        mount = ("sh", "-c", 'mount --bind "$0" /dev/shm && exec "$@"', str(memory_of(host)))
        return [*inside, *mount, *map(str, command)]

    def network(self, command: str) -> str:
        """Tell the network to be worse, or to count; see :mod:`network_relay`."""
        assert self._relay.stdin is not None
        assert self._relay.stdout is not None
        self._relay.stdin.write(command + "\n")
        self._relay.stdin.flush()
        return self._relay.stdout.readline().strip()

    def sent_bytes(self) -> dict[str, int]:
        """What each host has sent since the beginning [bytes]."""
        return dict(json.loads(self.network("bytes")))


def namespace_of(host: str) -> str:
    """The name of a host's namespace; two runs of the tests have each their own."""
    return f"pose-{os.getpid()}-{host}"


def memory_of(host: str) -> Path:
    """The folder that is a host's shared memory: two hosts would meet in it otherwise."""
    return Path("/dev/shm") / namespace_of(host)


def ip(*words: str) -> None:
    """Run ``ip``."""
    subprocess.run(["ip", *words], check=True, capture_output=True, text=True)


@contextlib.contextmanager
def make_hosts(names: Sequence[str]) -> Iterator[Hosts]:
    """Make the hosts; they and all that was made for them are gone afterwards."""
    if shutil.which("ip") is None or not os.access("/dev/net/tun", os.W_OK):
        pytest.skip("needs iproute2 and /dev/net/tun to make network namespaces")
    with contextlib.ExitStack() as stack:
        for name in names:
            try:
                ip("netns", "add", namespace_of(name))
            except subprocess.CalledProcessError as error:
                pytest.skip(f"may not make network namespaces: {error.stderr.strip()}")
            stack.callback(ip, "netns", "delete", namespace_of(name))
            memory_of(name).mkdir()
            stack.callback(shutil.rmtree, memory_of(name))
        words = [f"{name}={namespace_of(name)}" for name in names]
        relay = stack.enter_context(
            subprocess.Popen(
                [sys.executable, str(RELAY), *words],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        )
        assert relay.stdin is not None
        assert relay.stdout is not None
        stack.callback(relay.stdin.close)
        if relay.stdout.readline().strip() != "ready":
            pytest.skip("may not make TAP devices in network namespaces")
        hosts = Hosts(names, relay)
        for name, address in hosts.addresses.items():
            inside = ("-n", namespace_of(name))
            ip(*inside, "link", "set", "lo", "up")
            ip(*inside, "address", "add", f"{address}/24", "dev", "tap0")
            ip(*inside, "link", "set", "tap0", "up")
            ip(*inside, "route", "add", "224.0.0.0/4", "dev", "tap0")
        yield hosts
