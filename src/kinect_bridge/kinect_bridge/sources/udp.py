"""``udp``: frames from any program on this machine, or from named ones on others.

By default the socket is bound to the loopback address. Datagrams of one sender at a time are
accepted: the first, until it is silent for two seconds.
"""

import ipaddress
import socket
from collections.abc import Mapping
from contextlib import suppress

import msgspec

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources.datagram import MAX_BYTES, VERSION, decode, to_person
from kinect_bridge.sources.live import SILENCE_NS, ThreadedSource
from pose_core.errors import InputError, ParameterError
from pose_io.recordings.joint_map_files import find_joint_map

POLL_S = 0.2  # [s] largest delay until the thread ends
WRAP = 2**32  # of the sequence number
RESTART = 1000  # a larger step back means that the sender restarted
Address = ipaddress.IPv4Address | ipaddress.IPv6Address


class UdpSource(ThreadedSource):
    """Source of datagrams.

    Raises:
        PoseError: If the address is invalid, open to unnamed senders, or in use.
    """

    NAME = "udp"
    COUNTERS = (
        "datagrams_received",
        "datagrams_too_long",
        "datagrams_malformed",
        "datagrams_other_version",
        "datagrams_wrong_joints",  # names that the joint map does not have
        "datagrams_foreign_sender",  # from an address that is not allowed
        "datagrams_second_sender",  # while another sender is active
        "datagrams_late",  # behind one with a later sequence number
        "frames_lost",  # missing sequence numbers
        "sender_restarts",
    )

    def __init__(self, parameters: KinectBridgeParameters) -> None:
        address = _address("udp_address", parameters.udp_address)
        senders = filter(None, (each.strip() for each in parameters.udp_senders.split(",")))
        self._senders = frozenset(_address("udp_senders", each) for each in senders)
        if not address.is_loopback and not self._senders:
            raise ParameterError(
                f"udp_address = {address} can be reached from other machines: name the ones that "
                "may send in udp_senders, for example '192.168.1.20,192.168.1.21'"
            )
        joint_map = find_joint_map(parameters.joint_map or "pose_15")
        self._socket = _bound_socket(address, parameters.udp_port)
        host, port = self._socket.getsockname()[:2]
        super().__init__(f"{host}:{port}", joint_map)
        self._sender: tuple[object, ...] | None = None
        self._sender_ns = 0
        self._sequence: int | None = None

    def close(self) -> None:
        """End the thread and free the port."""
        super().close()
        self._socket.close()

    def details(self) -> Mapping[str, object]:
        """The active sender."""
        sender = self._sender
        return {"sender": "" if sender is None else f"{sender[0]}:{sender[1]}"}

    def _run(self) -> None:
        while not self._ends.is_set():
            # A timeout, or an ICMP message after the sender has ended.
            with suppress(OSError):
                self.hear(*self._socket.recvfrom(MAX_BYTES + 1))

    def hear(self, data: bytes, sender: tuple[object, ...]) -> None:
        """Process one datagram."""
        self.counters.add("datagrams_received")
        reason = self._refusal(data, sender)
        if reason is not None:
            self.counters.add(reason)
            return
        try:
            datagram = decode(data)
            people = [to_person(person, self.joint_map) for person in datagram.people]
        except KeyError:
            self.counters.add("datagrams_wrong_joints")
            return
        except msgspec.DecodeError:
            self.counters.add("datagrams_malformed")
            return
        if datagram.v != VERSION:
            self.counters.add("datagrams_other_version")
        elif self._is_next(datagram.seq):
            self._sender, self._sender_ns = sender, self._now_ns()
            self.push(people, datagram.time_ns)

    def _refusal(self, data: bytes, sender: tuple[object, ...]) -> str | None:
        """Counter of the reason to reject a datagram before decoding; None if accepted."""
        if self._senders and ipaddress.ip_address(str(sender[0])) not in self._senders:
            return "datagrams_foreign_sender"
        if self._sender not in (None, sender):
            if self._now_ns() - self._sender_ns < SILENCE_NS:
                return "datagrams_second_sender"
            self._sequence = None
        return "datagrams_too_long" if len(data) > MAX_BYTES else None

    def _is_next(self, sequence: int) -> bool:
        """Whether a sequence number is later than the previous one; counts missing ones."""
        before, step = self._sequence, 1
        if before is not None:
            step = (sequence - before + WRAP // 2) % WRAP - WRAP // 2
        if -RESTART < step <= 0:
            self.counters.add("datagrams_late")
            return False
        if abs(step) >= RESTART:
            self.counters.add("sender_restarts")
        else:
            self.counters.add("frames_lost", step - 1)
        self._sequence = sequence
        return True


def _address(name: str, text: str) -> Address:
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        raise ParameterError(
            f"{name} = {text!r} is not an IP address: give for example 127.0.0.1"
        ) from None


def _bound_socket(address: Address, port: int) -> socket.socket:
    family = socket.AF_INET if address.version == 4 else socket.AF_INET6
    bound = socket.socket(family, socket.SOCK_DGRAM)
    bound.settimeout(POLL_S)
    try:
        bound.bind((str(address), port))
    except OSError as error:
        bound.close()
        raise InputError(
            f"cannot listen on {address} port {port}: {error.strerror}: give another udp_port, or "
            "an address of this machine"
        ) from error
    return bound
