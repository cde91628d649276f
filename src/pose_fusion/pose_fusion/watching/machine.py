"""Whether a machine is fit for the graph: Python, cores, disk, shared memory, network."""

import os
import shutil
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from pose_fusion.watching.findings import Finding, note, ok, wrong

OLDEST, NEWEST = (3, 10), (3, 13)  # Python
FEWEST_CORES = 2
MIN_DISK_GB = 1.0  # [GB] a minute of two Kinects and nine IMUs takes about 20 MB
MIN_SHARED_MB = 32.0  # [MB] Fast DDS takes about half a megabyte a node
SHARED = Path("/dev/shm")
FASTDDS_FILES = ("fastrtps_*", "fastdds_*", "sem.fastrtps_*", "sem.fastdds_*")
DISCOVERY_GROUP = "239.255.0.1"  # where DDS participants find each other
MAX_DOMAIN = 101  # above, the ports reach into Linux's ephemeral range
TIMEOUT_S = 1.0
GB, MB = 1e9, 1e6  # [bytes]


def machine_findings(folder: Path, environment: Mapping[str, str]) -> Iterator[Finding]:
    """All findings about the machine.

    Args:
        folder: Where recordings go.
        environment: The process's variables.
    """
    yield python_finding(sys.version_info[:2])
    yield cores_finding(len(os.sched_getaffinity(0)))
    yield disk_finding(folder, shutil.disk_usage(folder).free)
    yield shared_memory_finding(SHARED)
    yield domain_finding(environment)
    yield multicast_finding(environment, multicast_works)


def python_finding(version: tuple[int, ...]) -> Finding:
    """Whether ROS 2 Jazzy and its wheels know this Python."""
    text = ".".join(map(str, version))
    if OLDEST <= version <= NEWEST:
        return ok("Python", text)
    return wrong("Python", text, "install 3.10 to 3.13, name it in POSE_PYTHON, run ./pose build")


def cores_finding(cores: int) -> Finding:
    """Whether there are enough for sensors and fusion side by side."""
    if cores >= FEWEST_CORES:
        return ok("cores", str(cores))
    remedy = "two or more are needed for real time: move bridges or recorder to another host"
    return wrong("cores", str(cores), remedy)


def disk_finding(folder: Path, free_bytes: float) -> Finding:
    """Whether there is room for recordings."""
    text = f"{free_bytes / GB:.1f} GB are free at {folder}"
    if free_bytes >= MIN_DISK_GB * GB:
        return ok("disk", text)
    remedy = f"{MIN_DISK_GB:g} GB are needed: free some space, or record elsewhere"
    return wrong("disk", text, remedy)


def shared_memory_finding(folder: Path) -> Finding:
    """Whether Fast DDS can pass messages through shared memory."""
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        remedy = "mount a tmpfs there (containers: --ipc=host or --shm-size)"
        return wrong("shared memory", f"{folder} is not there, or not writable", remedy)
    free_mb = shutil.disk_usage(folder).free / MB
    if free_mb < MIN_SHARED_MB:
        remedy = f"remove old {folder}/fastrtps_* files, or enlarge it (containers: --shm-size)"
        return wrong("shared memory", f"{free_mb:.0f} MB are free", remedy)
    owners = list(_owners_of_fastdds_files(folder))
    theirs = sum(owner != os.getuid() for owner in owners)
    if theirs and os.getuid() != 0:
        remedy = "run all nodes as one user; otherwise they cannot communicate"
        return note("shared memory", f"{theirs} Fast DDS files belong to other users", remedy)
    return ok("shared memory", f"{free_mb:.0f} MB are free, {len(owners)} Fast DDS files")


def _owners_of_fastdds_files(folder: Path) -> Iterator[int]:
    """The user's number for each file; a participant that leaves takes its files away."""
    for pattern in FASTDDS_FILES:
        for path in folder.glob(pattern):
            with suppress(FileNotFoundError):
                yield path.stat().st_uid


def domain_finding(environment: Mapping[str, str]) -> Finding:
    """Whether ROS_DOMAIN_ID is one, and who can hear us."""
    text = environment.get("ROS_DOMAIN_ID", "") or "0"
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "") or "SUBNET"
    if not text.isdigit() or int(text) > MAX_DOMAIN:
        remedy = f"set ROS_DOMAIN_ID to 0 … {MAX_DOMAIN}, the same on every host"
        return wrong("ROS domain", text, remedy)
    return ok("ROS domain", f"{text}, discovery range {reach}")


def multicast_finding(environment: Mapping[str, str], works: Callable[[], bool]) -> Finding:
    """Whether nodes on other hosts can be found."""
    if environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") in ("LOCALHOST", "OFF"):
        return ok("multicast", "not needed: discovery is limited to this host")
    if works():
        return ok("multicast", f"a datagram to {DISCOVERY_GROUP} came back")
    remedy = "allow UDP multicast in the firewall, or name the hosts in ROS_STATIC_PEERS"
    return wrong("multicast", f"a datagram to {DISCOVERY_GROUP} did not come back", remedy)


def multicast_works() -> bool:
    """Send a datagram to the discovery group and see whether it comes back."""
    try:
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        ):
            receiver.bind(("", 0))
            group = socket.inet_aton(DISCOVERY_GROUP) + socket.inet_aton("0.0.0.0")
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
            receiver.settimeout(TIMEOUT_S)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            sender.sendto(b"pose doctor", (DISCOVERY_GROUP, receiver.getsockname()[1]))
            return receiver.recv(64) == b"pose doctor"
    except OSError:
        return False
