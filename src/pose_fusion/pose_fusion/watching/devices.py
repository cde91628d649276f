"""Which sensors are plugged in, and whether this user may open them."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from serial.tools import list_ports

from pose_fusion.watching.findings import Finding, note, ok, wrong

USB_DEVICES = Path("/sys/bus/usb/devices")
MICROSOFT = "045e"
KINECTS = {  # USB product ids (usb-ids)
    "02ae": "Kinect v1 camera",
    "02bf": "Kinect v1 for Windows camera",
    "02c4": "Kinect v2",
    "02d8": "Kinect v2",
    "097c": "Azure Kinect depth camera",
}


@dataclass(frozen=True, kw_only=True)
class SerialPort:
    """A serial device of this machine."""

    path: str
    description: str
    may_open: bool
    group: str  # of the file


def serial_ports() -> list[SerialPort]:
    """The serial devices that are hardware: USB adapters, built-in ports that answer."""
    ports = []
    for port in sorted(list_ports.comports(), key=lambda port: port.device):
        path = Path(port.device)
        ports.append(
            SerialPort(
                path=port.device,
                description="serial port" if port.description == "n/a" else port.description,
                may_open=os.access(path, os.R_OK | os.W_OK),
                group=path.group() if path.exists() else "",
            )
        )
    return ports


def kinects(folder: Path = USB_DEVICES) -> list[str]:
    """Names of the Kinects on USB."""
    vendors = [v for v in sorted(folder.glob("*/idVendor")) if v.read_text().strip() == MICROSOFT]
    products = [path for path in (v.with_name("idProduct") for v in vendors) if path.is_file()]
    names = (KINECTS.get(path.read_text().strip()) for path in products)
    return [name for name in names if name is not None]


def device_findings(ports: Sequence[SerialPort], cameras: Sequence[str]) -> Iterator[Finding]:
    """What the devices tell."""
    if not ports:
        remedy = "plug in the IMUs' receiver; if there are no IMUs, ignore this"
        yield note("serial ports", "none", remedy)
    for port in ports:
        if port.may_open:
            yield ok(port.path, port.description)
            continue
        found = f"{port.description}, but this user may not open it"
        group = port.group or "dialout"
        remedy = f"sudo usermod -aG {group} $USER, then log in again"
        yield wrong(port.path, found, remedy)
    if cameras:
        yield ok("Kinects on USB", ", ".join(cameras))
    else:
        remedy = "recordings and skeletons of other hosts need none"
        yield note("Kinects on USB", "none", remedy)
