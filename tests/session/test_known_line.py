"""A line is compared with its stored identity, and held if it differs."""

from __future__ import annotations

import asyncio
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.adapters import Adapters, adapters
from tui.bus.api import Priority
from tui.bus.errors import LineError, RequestRefused
from tui.bus.fake import FakeLine
from tui.bus.limits import Limits
from tui.bus.line import Line
from tui.bus.link import SerialLink, TcpLink
from tui.drive.orders import OrderRefused
from tui.session.arming import Arming
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.known_line import KnownLine
from tui.session.connect.known_lines import (
    LINES_KEPT,
    LineMark,
    LinesMemory,
    keep_memory,
    line_name,
    load_memory,
    memory_file,
    remembered_text,
)
from tui.session.connect.line_key import line_key
from tui.session.starts.processes import Processes
from tui.session.starts.starts import Starts

__all__ = ["adapters"]

PUMP = DriveIdentity(2, "Telemecanique", "ATV71HU15M3", "0201", "PUMP", "atv71", ("atv71",))
FAN = replace(PUMP, reference="ATV71HD22N4", name="FAN")
SILENT = DriveIdentity(5, "", "", "", "", None, ("powerdrive", "varmeca"))
WRITES = Limits(frozenset({3, 6, 43}), 1, 1, 0, 0)


def on(path: str) -> FakeLine:
    """A line on a serial port, with a drive that may be written to."""
    line = FakeLine({2: {7: 0}}, link=SerialLink(path))
    line.describe(2, WRITES)
    return line


def known(line: FakeLine, *drives: DriveIdentity, profile: str = "") -> KnownLine:
    """The line, reopened, with the drives that answered."""
    found = KnownLine(line)
    for drive in drives:
        found.note(drive, drive.device, profile)
    return found


def test_unchanged_line_is_not_held(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), PUMP)
    line = on(port)
    assert known(line, PUMP).changed == ()
    assert line.held == ""


def test_other_adapter_under_the_same_name_holds_the_line(adapters: Adapters) -> None:
    known(on(adapters.plug("ttyUSB0", "1.1", serial="A5")))
    adapters.unplug("ttyUSB0")
    line = on(adapters.plug("ttyUSB0", "1.1", serial="B7"))
    found = known(line)
    (reported,) = found.changed
    assert "ttyUSB0 was" in reported
    assert "A5" in reported
    assert "B7" in reported
    assert reported in line.held
    assert "--accept-line" in line.held
    # it is not stored before a person has confirmed it
    assert known(on(adapters.port("ttyUSB0"))).changed == (reported,)
    found.accept()
    assert line.held == ""
    assert known(on(adapters.port("ttyUSB0"))).changed == ()


def test_renumbered_adapter_is_the_same_line(adapters: Adapters) -> None:
    known(on(adapters.plug("ttyUSB0", "1.1", serial="A5")), PUMP)
    adapters.unplug("ttyUSB0")
    port = adapters.plug("ttyUSB4", "1.3", serial="A5")
    assert known(on(port), PUMP).changed == ()
    assert known(on(port), FAN).changed != ()


def test_shared_by_id_name_of_the_other_adapter_holds_the_line(
    adapters: Adapters,
) -> None:
    adapters.plug("ttyUSB0", "1.1")
    by_id = str(adapters.links / "by-id" / "usb-FTDI_6001-if00-port0")
    known(on(by_id))
    adapters.plug("ttyUSB1", "1.2")
    (reported,) = known(on(by_id)).changed
    assert "1.1" in reported
    assert "1.2" in reported


def test_other_adapter_in_the_same_socket_holds_the_line(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1")
    socket = str(adapters.links / "by-path" / "pci-usb-1.1-port0")
    known(on(socket))
    adapters.plug("ttyUSB0", "1.1", product="7523")
    (reported,) = known(on(socket)).changed
    assert "0403:6001" in reported
    assert "0403:7523" in reported
    assert known(on(port)).changed != ()


def test_line_that_reconnects_with_another_adapter_is_held(adapters: Adapters) -> None:
    line = on(adapters.plug("ttyUSB0", "1.1", serial="A5"))
    found = known(line, PUMP)
    adapters.unplug("ttyUSB0")
    adapters.plug("ttyUSB0", "1.1", serial="B7")
    found.look()
    assert "B7" in line.held
    adapters.unplug("ttyUSB0")
    adapters.plug("ttyUSB0", "1.1", serial="A5")
    found.look()
    assert line.held == ""


def test_other_drive_at_an_address_holds_the_line(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), PUMP)
    line = on(port)
    found = known(line, FAN)
    assert found.changed == (
        "Device 2 was ATV71HU15M3 PUMP, version 2.1, and is ATV71HD22N4 FAN, version 2.1 now.",
    )
    assert found.changed[0] in line.held
    assert known(on(port), FAN).changed != ()
    found.accept()
    assert known(on(port), FAN).changed == ()
    assert known(on(port), PUMP).changed != ()


def test_other_firmware_version_is_another_drive(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), PUMP)
    assert known(on(port), replace(PUMP, version="0302")).changed != ()


def test_drive_without_identification_is_known_by_its_profile(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), SILENT, profile="powerdrive")
    assert known(on(port), SILENT, profile="powerdrive").changed == ()
    assert known(on(port), SILENT).changed == ()
    (reported,) = known(on(port), SILENT, profile="varmeca").changed
    assert reported == "Device 5 was Powerdrive, and is Varmeca 33/34 now."


def test_incomplete_identity_does_not_replace_the_stored_one(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), PUMP)
    less = DriveIdentity(2, "", "", "", "", None, ())
    assert known(on(port), less, profile="atv71").changed == ()
    assert known(on(port), FAN).changed != ()


def test_new_or_absent_drive_does_not_hold_the_line(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), PUMP)
    assert known(on(port), replace(FAN, device=3)).changed == ()
    assert {*load_memory().lines[line_key(port)].drives} == {2, 3}


def test_confirmation_in_advance_covers_and_stores_the_next_drive(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), PUMP)
    line = on(port)
    found = KnownLine(line)
    found.accept(all_that_comes=True)
    found.note(FAN, 2)
    assert line.held == ""
    assert known(on(port), FAN).changed == ()


def test_confirmation_does_not_cover_later_changes(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    known(on(port), PUMP, replace(PUMP, device=3))
    line = on(port)
    found = known(line, FAN)
    found.accept()
    found.note(replace(FAN, device=3), 3)
    assert "Device 3" in line.held


async def test_held_line_accepts_stops_only(adapters: Adapters) -> None:
    line = on(adapters.plug("ttyUSB0", "1.1", serial="A5"))
    line.held = "Not yet."
    with pytest.raises(RequestRefused, match="Not yet"):
        await line.write(2, 7, [1])
    assert (await line.read(2, 7)).words == (0,)
    await line.write(2, 7, [5], priority=Priority.STOP)
    assert (await line.read(2, 7)).words == (5,)


def test_held_line_arms_no_drive() -> None:
    line = FakeLine()
    line.held = "Not yet."
    with pytest.raises(OrderRefused, match="Not yet"):
        Arming(line).arm()
    line.held = ""
    arming = Arming(line)
    arming.arm()
    assert arming.armed
    line.held = "Not the same any more."
    assert not arming.armed
    assert arming.refusal() == "Not the same any more."
    line.held = ""
    assert not arming.armed


@pytest.mark.parametrize(("priority", "reaches"), [(Priority.STOP, True), (Priority.POLL, False)])
async def test_real_line_is_held_too(priority: Priority, *, reaches: bool) -> None:
    line = Line(TcpLink("127.0.0.1", 1))
    line.describe(2, WRITES)
    line.held = "Not yet."
    with pytest.raises(LineError) as refused:
        await asyncio.wait_for(line.write(2, 7, [1], priority=priority), 10)
    assert ("Not yet" in str(refused.value)) is not reaches


def test_gateways_are_known_by_their_drives() -> None:
    def gateway() -> FakeLine:
        return FakeLine(link=TcpLink("Gateway.Plant"))

    known(gateway(), PUMP)
    assert known(gateway(), FAN).changed != ()
    assert known(FakeLine(link=TcpLink("gateway.plant", 503)), FAN).changed == ()


def test_pseudo_terminal_number_is_not_stored_but_a_link_is(tmp_path: Path) -> None:
    master, slave = os.openpty()
    try:
        number, link = os.ttyname(slave), tmp_path / "line"
        link.symlink_to(number)
        assert line_name(SerialLink(number)).key == ""
        assert line_name(SerialLink(str(link))).key == f"serial:{link}"
        known(on(number), PUMP)
        assert load_memory() == LinesMemory()
        known(on(str(link)), PUMP)
        assert known(on(str(link)), FAN).changed != ()
    finally:
        os.close(master)
        os.close(slave)


def test_recorded_start_is_found_at_the_new_port_of_its_adapter(adapters: Adapters) -> None:
    class Ended(Processes):
        """Every program has ended."""

        def lives(self, *_: object) -> bool:
            """None does."""
            return False

    port = f"serial:{adapters.plug('ttyUSB0', '1.1', serial='A5')},19200,8E1"
    starts = Starts(processes=Ended())
    starts.begin(starts.record(port, PUMP, "atv71", "forward", program="run"))
    adapters.unplug("ttyUSB0")
    adapters.plug("ttyUSB0", "1.2", serial="B7")
    moved = adapters.plug("ttyUSB1", "1.1", serial="A5")
    assert Starts(processes=Ended()).found(port, 2) is None
    found = Starts(processes=Ended()).found(moved, 2)
    assert found is not None
    starts = Starts(processes=Ended())
    starts.sent(moved, 2)
    starts.end(moved, 2)
    assert starts.close(60)
    assert Starts(processes=Ended()).found(moved, 2) is None


def test_line_is_stored_by_its_adapter(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1.1", serial="A5")
    by_id = str(adapters.links / "by-id" / "usb-FTDI_6001_A5-if00-port0")
    assert remembered_text(f"{port},9600,8N1,timeout=2") == f"serial:{by_id},9600,8N1,timeout=2"
    assert remembered_text(by_id) == by_id
    assert line_key(port) == line_key(by_id)
    for other in ("tcp:gateway", "sim:atv71", "/dev/ttyS77", "no line"):
        assert remembered_text(other) == other


@pytest.mark.parametrize(
    "stored",
    [
        b"",
        b"\xff\xfe",
        b"[1]",
        b"[" * 100_000,
        b'{"lines": 3, "names": []}',
        b'{"lines": {"serial:/dev/ttyS1": 3, "x": {"adapter": 1, "drives": []}}}',
        b'{"lines": {}, "names": {"a": 1}}',
        b'{"lines": {"x": {"drives": {"two": {}, "2": 7, "3": {"vendor": 1}}}}}',
    ],
    ids=range(8),
)
def test_damaged_line_store_is_empty_and_blocks_nothing(stored: bytes) -> None:
    memory_file().parent.mkdir(parents=True)
    memory_file().write_bytes(stored)
    assert all(not mark.drives for mark in load_memory().lines.values())
    line = on("/dev/ttyS1")
    assert known(line, PUMP).changed == ()
    assert known(line, FAN).changed != ()


def test_unusable_line_store_blocks_nothing() -> None:
    memory_file().parent.mkdir(parents=True)
    os.mkfifo(memory_file())
    assert load_memory() == LinesMemory()
    memory_file().unlink()
    memory_file().mkdir()
    assert known(on("/dev/ttyS1"), PUMP).changed == ()


def test_line_store_is_bounded() -> None:
    keep_memory(LinesMemory({f"tcp:{n}": LineMark() for n in range(LINES_KEPT + 5)}, {}))
    stored: Any = json.loads(memory_file().read_text("utf-8"))
    assert len(stored["lines"]) == LINES_KEPT
    known(FakeLine(link=TcpLink("new")))
    assert next(iter(load_memory().lines)) == "tcp:new:502"
