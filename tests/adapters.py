"""Serial adapters in different sockets, as the system's folders list them."""

from __future__ import annotations

from pathlib import Path

import pytest


class Adapters:
    """Ports `ttyUSB0` ... with the system's links to them, in a folder of the test."""

    def __init__(self, folder: Path) -> None:
        self.dev, self.links, self.system = folder / "dev", folder / "serial", folder / "tty"
        for path in (self.dev, self.links / "by-id", self.links / "by-path", self.system):
            path.mkdir(parents=True)
        self._devices = folder / "devices"

    def use(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Make the project use these folders."""
        monkeypatch.setattr("tui.bus.transport.port_names.DEVICE_LINKS", self.links)
        monkeypatch.setattr("tui.bus.transport.port_names.SYSTEM_PORTS", self.system)

    def port(self, name: str) -> str:
        """Return the path of a port."""
        return str(self.dev / name)

    def plug(
        self,
        name: str,
        socket: str,
        *,
        serial: str = "",
        product: str = "6001",
        leads_to: Path | None = None,
    ) -> str:
        """Plug an adapter into a socket; return the path of its port `name`.

        With `leads_to` the port is a link to a pseudo-terminal, for example.
        """
        port = self.dev / name
        port.unlink(missing_ok=True)
        if leads_to is None:
            port.touch()
        else:
            port.symlink_to(leads_to)
        real = port.resolve()
        device = self._devices / socket
        device.mkdir(parents=True, exist_ok=True)
        for file, text in (("idVendor", "0403"), ("idProduct", product), ("serial", serial)):
            (device / file).unlink(missing_ok=True)
            if text:
                (device / file).write_text(f"{text}\n")
        (device / "interface" / name).mkdir(parents=True, exist_ok=True)
        known = self.system / real.name
        known.mkdir(exist_ok=True)
        self._link(known / "device", device / "interface" / name)
        make = f"usb-FTDI_{product}{'_' + serial.replace(' ', '_') if serial else ''}-if00-port0"
        self._link(self.links / "by-id" / make, real)
        self._link(self.links / "by-path" / f"pci-usb-{socket}-port0", real)
        return str(port)

    def unplug(self, name: str) -> None:
        """Unplug the adapter of a port; its links are removed."""
        real = (self.dev / name).resolve()
        for folder in ("by-id", "by-path"):
            for link in (self.links / folder).iterdir():
                if link.resolve() == real:
                    link.unlink()
        (self.system / real.name / "device").unlink()
        (self.dev / name).unlink()

    @staticmethod
    def _link(link: Path, to: Path) -> None:
        """Link as the system does: the newest adapter gets the name."""
        link.unlink(missing_ok=True)
        link.symlink_to(to)


@pytest.fixture
def adapters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Adapters:
    """No adapter yet; the project searches these folders."""
    found = Adapters(tmp_path / "machine")
    found.use(monkeypatch)
    return found
