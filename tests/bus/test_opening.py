"""A serial port that opens slowly: the loop of its line keeps running."""

from __future__ import annotations

import asyncio
import os
import threading
import time
from collections.abc import Iterator

import pytest
import serial

from tests.limits import ALARM_AFTER
from tui.bus.errors import LineLost, PortMissing
from tui.bus.transport import opening
from tui.bus.transport.opening import closed_beside, opened_beside
from tui.bus.transport.serial_posix import PosixSerial

from .peer import eventually


class SlowPort:
    """A port that is opened once it may be."""

    def __init__(self) -> None:
        self.may_open = threading.Event()
        self.closed = threading.Event()

    def open(self) -> SlowPort:
        assert self.may_open.wait(20)
        return self

    async def opened(self) -> SlowPort:
        return await opened_beside("port", self.open, lambda port: port.closed.set())


@pytest.fixture
def port() -> Iterator[SlowPort]:
    made = SlowPort()
    yield made
    made.may_open.set()
    eventually(lambda: not opening._ABANDONED)


async def test_loop_runs_while_a_port_opens(port: SlowPort) -> None:
    waiting = asyncio.create_task(port.opened())
    await asyncio.sleep(0.05)
    assert not waiting.done()
    port.may_open.set()
    assert await waiting is port
    assert not port.closed.is_set()


async def test_reason_of_a_refused_port_is_raised() -> None:
    def missing() -> SlowPort:
        raise PortMissing("port")

    with pytest.raises(PortMissing):
        await opened_beside("port", missing, lambda _: None)


async def test_port_that_opens_too_late_is_closed(
    port: SlowPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opening, "OPENS_WITHIN", 0.05)
    with pytest.raises(LineLost, match="the system does not answer"):
        await port.opened()
    # not one more thread for each try
    before = threading.active_count()
    with pytest.raises(LineLost, match="the system does not answer"):
        await port.opened()
    assert threading.active_count() == before
    port.may_open.set()
    assert await asyncio.to_thread(port.closed.wait, 20)


async def test_port_that_opens_after_its_line_closed_is_closed(port: SlowPort) -> None:
    waiting = asyncio.create_task(port.opened())
    await asyncio.sleep(0.05)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    port.may_open.set()
    assert await asyncio.to_thread(port.closed.wait, 20)


async def test_loop_runs_while_the_system_closes_a_port(port: SlowPort) -> None:
    begun = time.monotonic()
    # a driver that waits for the last bytes of an adapter that accepts none
    closed_beside("port", port.open)
    assert time.monotonic() - begun < ALARM_AFTER
    with pytest.raises(LineLost, match="the system does not answer"):
        await port.opened()
    port.may_open.set()
    eventually(lambda: not opening._ABANDONED)
    assert await port.opened() is port


async def test_line_waits_until_its_port_is_closed() -> None:
    closed = threading.Event()
    closed_beside("port", closed.set)
    assert closed.is_set()
    assert not opening._ABANDONED


async def test_serial_line_does_not_wait_for_a_port_that_hangs_on_close(
    port: SlowPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    master, slave = os.openpty()
    try:
        serial_port = serial.Serial(os.ttyname(slave), timeout=0)
        transport = PosixSerial(serial_port)
        close = serial_port.close
        monkeypatch.setattr(serial_port, "close", lambda: (port.open(), close()))
        begun = time.monotonic()
        transport.close()
        assert time.monotonic() - begun < ALARM_AFTER
        port.may_open.set()
        eventually(lambda: not serial_port.is_open)
    finally:
        os.close(master)
        os.close(slave)
