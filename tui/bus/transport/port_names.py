"""The lasting name of a serial port: that of its adapter, whatever number it has today.

The system numbers adapters as they come (`/dev/ttyUSB0`). It also keeps links to them: by-id,
named by maker, model and serial number, and by-path, named by the socket that they are in. An
adapter without a serial number shares its by-id name with every other of its make, so that it is
known by its socket alone.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

DEVICE_LINKS = Path("/dev/serial")
"""The folder with `by-id` and `by-path`; there on Linux with udev."""
SYSTEM_PORTS = Path("/sys/class/tty")
_NUMBER = re.compile(r"\d+$")
_OWN_SIGN = re.compile(r"[^0-9A-Za-z#+.:=@_-]")


@dataclass(frozen=True, slots=True)
class PortName:
    """Lasting name of a port."""

    path: str
    """A link that leads to this adapter only, else the port's own path."""
    adapter: str = ""
    """USB vendor, product and serial number of the adapter; empty where there is none."""
    shared: bool = False
    """True if its by-id name belongs to its make, and not to this adapter alone."""

    @property
    def lasting(self) -> bool:
        """True if the path stays the adapter's, or at least its socket's."""
        return bool(self.adapter)


@dataclass(frozen=True, slots=True)
class _UsbDevice:
    place: str
    vendor: str
    product: str
    serial: str

    @property
    def text(self) -> str:
        return f"{self.vendor}:{self.product} {self.serial}".strip()


def lasting_name(path: str, links: Path | None = None, system: Path | None = None) -> PortName:
    """Return the lasting name of the port at a path; links are followed as they are now.

    `links` and `system` are the folders of device links and of ports, those of this machine
    unless given.
    """
    links, system = links or DEVICE_LINKS, system or SYSTEM_PORTS
    real = os.path.realpath(path)
    usb = _usb_device(system / os.path.basename(real))
    if usb is None:
        return PortName(real)
    by_id = next(_links_to(links / "by-id", real), "")
    own = bool(usb.serial) and not _has_twin(usb, os.path.basename(real), system)
    if by_id and own and _OWN_SIGN.sub("_", usb.serial) in os.path.basename(by_id):
        return PortName(by_id, usb.text)
    by_path = next(_links_to(links / "by-path", real), "")
    return PortName(by_path or real, usb.text, shared=not own)


def _links_to(folder: Path, real: str) -> Iterator[str]:
    """Links in a folder that lead to a port, the shortest name first."""
    try:
        names = sorted(os.listdir(folder), key=lambda name: (len(name), name))
    except OSError:
        return
    for name in names:
        link = os.path.join(folder, name)
        if os.path.realpath(link) == real:
            yield link


def _has_twin(usb: _UsbDevice, port: str, system: Path) -> bool:
    """Return True if another adapter says the same of itself, its serial number too."""
    kind = _NUMBER.sub("", port)
    try:
        names = [name for name in os.listdir(system) if _NUMBER.sub("", name) == kind]
    except OSError:
        return False
    others = (_usb_device(system / name) for name in names if name != port)
    return any(other and other.place != usb.place and other.text == usb.text for other in others)


def _usb_device(port: Path) -> _UsbDevice | None:
    """The USB device behind a port; None for one that is not on USB."""
    place = os.path.realpath(port / "device")
    for _ in range(4):  # the port, its interface, the device
        if (vendor := first_line(place, "idVendor")) and (
            product := first_line(place, "idProduct")
        ):
            return _UsbDevice(place, vendor, product, first_line(place, "serial"))
        place = os.path.dirname(place)
    return None


def first_line(folder: str, name: str) -> str:
    """The first line of a file of the system; empty where it is not there."""
    try:
        with open(os.path.join(folder, name), encoding="utf-8", errors="replace") as file:
            return file.readline(256).strip()
    except OSError:
        return ""
