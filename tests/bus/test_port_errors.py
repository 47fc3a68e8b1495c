"""Error counts of a port, and their increase as reported by the line."""

from __future__ import annotations

import os
import pty
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.adapters import Adapters
from tests.adapters import adapters as adapters  # the fixture is for these tests too
from tui.bus.link import SerialLink
from tui.bus.master import LineContext, ResultKind, Sending
from tui.bus.requests import Read
from tui.bus.rtu.master import RtuMaster
from tui.bus.tally import Tally
from tui.bus.trace import Trace
from tui.bus.transport.port_errors import PortErrors, port_errors
from tui.bus.transport.ports import _is_no_port, latency_of, see_port

from .conftest import BRISK
from .peer import reply
from .test_hostile_peers import QUESTION, REQUEST, CommandBlocked

pytestmark = pytest.mark.skipif(os.name != "posix", reason="no ports like these here")


def counting(*readings: PortErrors) -> Iterator[PortErrors]:
    """A port with these counts in turn; the last one stays."""
    yield from readings
    while True:
        yield readings[-1]


def test_error_counts_are_read_in_the_order_of_the_system(monkeypatch: pytest.MonkeyPatch) -> None:
    def tells(_fd: int, _asks: int, counts: list[int]) -> int:
        for place in range(len(counts)):
            counts[place] = place
        return 0

    monkeypatch.setattr("fcntl.ioctl", tells)
    # of cts, dsr, rng, dcd, rx, tx, frame, overrun, parity, brk, buf_overrun
    assert port_errors(0) == PortErrors(framing=6, parity=8, breaks=9, overruns=7 + 10)


def test_pseudo_terminal_has_no_error_counts() -> None:
    master, slave = pty.openpty()
    try:
        assert port_errors(slave) is None
    finally:
        os.close(master)
        os.close(slave)


def test_counts_restart_with_the_driver() -> None:
    before, now = PortErrors(5, 0, 2, 0), PortErrors(9, 1, 2, 0)
    assert now.since(before) == PortErrors(4, 1, 0, 0)
    assert PortErrors(1, 0, 0, 0).since(before) == PortErrors(1, 0, 0, 0)


@pytest.mark.parametrize("answered", [False, True])
async def test_added_request_is_counted_if_a_reply_fails(answered: bool) -> None:
    counts = counting(PortErrors(7, 1, 0, 0), PortErrors(10, 1, 2, 0))
    transport, tally = CommandBlocked(b""), Tally()
    around = LineContext(BRISK, Trace(9), tally, time.monotonic, lambda *_: None)
    master = RtuMaster(
        transport, SerialLink("x"), around, lambda: None,
        wire_time=False, port_errors=lambda: next(counts),
    )  # fmt: skip
    honest_send = transport.send

    async def send(data: bytes) -> None:
        transport.held = reply(b"\x01" + QUESTION + b"\0\0") if answered else b"\x80\0\x80\xf8\0"
        await honest_send(data)

    transport.send = send  # type: ignore[method-assign]
    result = await master.exchange(Sending(1, QUESTION, REQUEST.expectation(), 0.05))
    assert result.kind is (ResultKind.REPLY if answered else ResultKind.DAMAGED)
    assert isinstance(REQUEST, Read)
    reported = tally.frozen()
    assert (reported.framing, reported.parity, reported.breaks) == (
        (0, 0, 0) if answered else (3, 0, 2)
    )
    master.close()


# What is seen of a port without opening it


def test_missing_port_is_seen_as_missing(tmp_path: Path) -> None:
    assert see_port(str(tmp_path / "none")).there is False


@pytest.mark.parametrize(
    ("path", "is_none"), [("/dev/null", True), (__file__, True), ("/dev/nowhere", False)]
)
def test_file_or_null_device_is_recognized_as_no_port(path: str, is_none: bool) -> None:
    assert _is_no_port(path) == is_none


def test_port_without_permission_names_its_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "port"
    path.touch(mode=0o660)
    path.chmod(0o660)
    monkeypatch.setattr("os.access", lambda *_: False)
    seen = see_port(str(path))
    import grp

    assert (seen.permitted, seen.group) == (False, grp.getgrgid(os.getgid()).gr_name)
    path.chmod(0o600)
    assert see_port(str(path)).group == ""


def test_group_membership_that_needs_a_new_login_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import grp
    import pwd

    path = tmp_path / "port"
    path.touch()
    path.chmod(0o660)
    user = pwd.getpwuid(os.geteuid()).pw_name
    group = grp.struct_group(("wires", "", 4711, [user]))
    monkeypatch.setattr("grp.getgrgid", lambda _: group)
    monkeypatch.setattr("os.getgroups", list)
    monkeypatch.setattr("os.getegid", lambda: -1)
    seen = see_port(str(path))
    assert (seen.group, seen.in_group, seen.user) == ("wires", True, user)


def test_latency_of_an_adapter_is_read(adapters: Adapters) -> None:
    port = adapters.plug("ttyUSB0", "1-1", serial="A1")
    assert latency_of(port) is None
    device = adapters.system / "ttyUSB0" / "device"
    (device / "latency_timer").write_text("16\n")
    assert see_port(port).latency == 16
