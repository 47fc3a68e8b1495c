"""The lasting name of a port: the adapter's own where it has one, else that of its socket."""

from __future__ import annotations

import errno
import os
from types import SimpleNamespace

import pytest

from tests.adapters import Adapters, adapters
from tui.bus.errors import PortBusy, PortMissing, PortRefused
from tui.bus.transport import ports
from tui.bus.transport.port_names import lasting_name
from tui.bus.transport.ports import PortSeen, port_error

__all__ = ["adapters"]

PORT_PATH = "/dev/ttyUSB0"


def test_adapter_with_a_serial_number_keeps_its_name_in_any_socket(adapters: Adapters) -> None:
    first = lasting_name(adapters.plug("ttyUSB0", "1.1", serial="A50285BI"))
    assert first.path == str(adapters.links / "by-id" / "usb-FTDI_6001_A50285BI-if00-port0")
    assert (first.adapter, first.lasting, first.shared) == ("0403:6001 A50285BI", True, False)
    adapters.unplug("ttyUSB0")
    assert lasting_name(adapters.plug("ttyUSB3", "1.4", serial="A50285BI")) == first
    assert lasting_name(first.path) == first


def test_adapter_without_a_serial_number_is_known_by_its_socket(adapters: Adapters) -> None:
    found = lasting_name(adapters.plug("ttyUSB0", "1.1"))
    assert found.path == str(adapters.links / "by-path" / "pci-usb-1.1-port0")
    assert (found.adapter, found.shared) == ("0403:6001", True)


def test_adapters_with_the_same_by_id_name_are_distinguished(adapters: Adapters) -> None:
    name = lasting_name(adapters.plug("ttyUSB0", "1.1"))
    two = lasting_name(adapters.plug("ttyUSB1", "1.2"))
    assert name.path != two.path
    shared = adapters.links / "by-id" / "usb-FTDI_6001-if00-port0"
    # typed by the shared name, it is the adapter that the name leads to
    assert lasting_name(str(shared)) == two


def test_adapters_with_the_same_serial_number_are_distinguished(adapters: Adapters) -> None:
    port_name = lasting_name(adapters.plug("ttyUSB0", "1.1", serial="0001"))
    assert not port_name.shared
    two = adapters.plug("ttyUSB1", "1.2", serial="0001")
    names = [lasting_name(adapters.port("ttyUSB0")), lasting_name(two)]
    assert [name.path for name in names] == [
        str(adapters.links / "by-path" / f"pci-usb-1.{n}-port0") for n in (1, 2)
    ]
    assert all(name.shared for name in names)


def test_ports_of_one_adapter_are_not_duplicates(adapters: Adapters) -> None:
    text = adapters.plug("ttyUSB0", "1.1", serial="FT4232")
    interface = adapters.system / "ttyUSB1"
    interface.mkdir()
    (interface / "device").symlink_to((adapters.system / "ttyUSB0" / "device").resolve())
    assert not lasting_name(text).shared


def test_serial_number_with_invalid_characters_is_found(adapters: Adapters) -> None:
    assert "by-id" in lasting_name(adapters.plug("ttyUSB0", "1.1", serial="A 5")).path


def test_port_without_usb_has_its_own_path(adapters: Adapters) -> None:
    (adapters.dev / "ttyS0").touch()
    port = adapters.port("ttyS0")
    found = lasting_name(port)
    assert (found.path, found.adapter, found.lasting) == (port, "", False)
    link = adapters.dev / "pump"
    link.symlink_to(port)
    assert lasting_name(str(link)).path == port


def test_machine_without_device_folders_names_no_adapter(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    nowhere = adapters.dev / "nowhere"
    assert lasting_name(port, nowhere, nowhere).path == port
    assert lasting_name(port, nowhere, adapters.system).path == port


@pytest.mark.parametrize(
    ("seen", "output"),
    [
        (
            PortSeen(PORT_PATH, permitted=False, group="rs485", user="ann"),
            "only the group rs485 may use it, and ann is not in it: sudo usermod -a -G rs485 ann",
        ),
        (
            PortSeen(PORT_PATH, permitted=False, group="rs485", user="ann", in_group=True),
            "ann is in its group rs485 since the next log-in only: log out and in again.",
        ),
        (
            PortSeen(PORT_PATH, permitted=False, user="ann"),
            "no group of users may. `drivepanel why /dev/ttyUSB0` shows what to do.",
        ),
    ],
)
def test_port_without_permission_names_its_group(
    seen: PortSeen, output: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.transport.ports.see_port", lambda _: seen)
    error = port_error(PORT_PATH, 19200, "8E1", PermissionError(errno.EACCES, "denied"))
    assert output in str(error)


@pytest.mark.parametrize(
    ("system", "text", "kind"),
    [
        ("nt", "FileNotFoundError(2, ...)", PortMissing),
        ("nt", "PermissionError(13, ...)", PortBusy),
        ("nt", "OSError(22, ...)", PortRefused),
        ("posix", "FileNotFoundError(2, ...)", PortRefused),
        ("posix", "PermissionError(13, ...)", PortRefused),
    ],
)
def test_error_without_a_number_is_known_by_its_text_on_windows(
    system: str, text: str, kind: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ports, "os", SimpleNamespace(**vars(os) | {"name": system}))
    monkeypatch.setattr(ports, "list_ports", list)
    assert type(port_error("COM9", 9600, "8N1", Exception(text))) is kind
