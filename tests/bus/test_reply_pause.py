"""A reply that arrives in single characters costs the loop a few turns, not one for each."""

from __future__ import annotations

import asyncio
import os
import pty
import select
import time
import tty
from collections.abc import AsyncIterator

import pytest
import serial

from tui.bus.link import SerialLink, character_time
from tui.bus.master import LineContext, ResultKind, Sending
from tui.bus.requests import Read, Request, WriteOne
from tui.bus.rtu.exchange import REFUSAL, RtuExchange
from tui.bus.rtu.master import BEFORE_END, RtuMaster
from tui.bus.tally import Tally
from tui.bus.trace import Trace
from tui.bus.transport import serial_posix
from tui.bus.transport.serial_posix import SHORT_PAUSE, PosixSerial
from tui.wire.frames import frame

from .conftest import BRISK
from .peer import honest_pdu
from .test_hostile_peers import CommandBlocked, Taker

READ = Read(1, 5, 20)
REPLY = frame(1, honest_pdu(READ.pdu()))
LINE = SerialLink("x", 19200)


def missing_after(data: bytes, request: Request = READ, **more: bool | int | None) -> int:
    requested = frame(request.device, request.pdu())
    exchange = RtuExchange(requested, request.expectation(), **more)  # type: ignore[arg-type]
    exchange.feed(data)
    return exchange.missing


def test_missing_counts_the_rest_of_a_partial_reply() -> None:
    found = [missing_after(REPLY[:length], echo=False) for length in range(len(REPLY))]
    # before the byte count it may be a refusal
    assert found == [0, 4, 3, *range(len(REPLY) - 3, 0, -1)]


def test_missing_is_unknown_before_the_reply_to_this_request() -> None:
    assert missing_after(b"\0" + REPLY[:9]) == 0
    assert missing_after(frame(1, bytes([0x83, 2]))[:4]) == 0
    assert missing_after(frame(1, honest_pdu(Read(1, 5, 2).pdu()))[:5]) == 0
    assert missing_after(REPLY[:9], skip=1) == 0


def test_missing_waits_for_a_known_echo_first() -> None:
    requested = frame(1, READ.pdu())
    assert missing_after(requested, echo=True) == 0
    assert missing_after(requested + REPLY[:9], echo=True) == len(REPLY) - 9
    write = WriteOne(1, 5, 7)
    assert missing_after(frame(1, write.pdu()), write, echo=True) == 0


async def test_master_pauses_until_just_before_the_end_of_a_reply() -> None:
    paused: list[float] = []
    transport = CommandBlocked(b"")
    around = LineContext(BRISK, Trace(9), Tally(), time.monotonic, lambda *_: None)
    master = RtuMaster(transport, LINE, around, lambda: None, wire_time=False)
    master.pause = paused.append
    honest_send = transport.send

    async def send(data: bytes) -> None:
        await honest_send(data)
        for part in (REPLY[:2], REPLY[2:5], REPLY[5:-1], REPLY[-1:]):
            asyncio.get_running_loop().call_soon(master.received, part, time.monotonic())

    transport.send = send  # type: ignore[method-assign]
    result = await master.exchange(Sending(1, READ.pdu(), READ.expectation(), 5.0))
    assert result.kind is ResultKind.REPLY
    lengths = REFUSAL - 2, len(REPLY) - 5
    assert paused == [length * character_time(LINE) - BEFORE_END for length in lengths]
    master.close()


@pytest.fixture
async def port() -> AsyncIterator[tuple[PosixSerial, Taker, int]]:
    master, slave = pty.openpty()
    tty.setraw(slave)
    transport, taker = PosixSerial(serial.Serial(os.ttyname(slave), timeout=0)), Taker()
    transport.start(taker)
    try:
        yield transport, taker, master
    finally:
        transport.close()
        os.close(master)
        os.close(slave)


async def turns() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def come(transport: PosixSerial, peer: int, data: bytes) -> None:
    """Have bytes lie ready, and give the loop its turns."""
    os.write(peer, data)
    assert transport._fd is not None
    assert select.select([transport._fd], [], [], 10.0)[0]
    await turns()


async def test_paused_port_leaves_bytes_until_something_is_sent(
    port: tuple[PosixSerial, Taker, int],
) -> None:
    transport, taker, peer = port
    transport.pause(3600.0)
    await come(transport, peer, b"rest of a reply")
    assert taker.data == b""
    await transport.send(b"next")
    await turns()
    assert taker.data == b"rest of a reply"


async def test_paused_port_takes_bytes_once_the_time_is_over(
    port: tuple[PosixSerial, Taker, int],
) -> None:
    transport, taker, peer = port
    transport.pause(SHORT_PAUSE + 0.001)
    transport.pause(3600.0)  # one is enough
    await come(transport, peer, b"rest of a reply")
    async with asyncio.timeout(10.0):
        while not taker.data:  # noqa: ASYNC110
            await asyncio.sleep(0.001)
    assert taker.data == b"rest of a reply"


async def test_short_pause_reads_pending_bytes_without_the_loop(
    port: tuple[PosixSerial, Taker, int],
) -> None:
    transport, taker, peer = port
    os.write(peer, b"rest of a reply")
    assert transport._fd is not None
    assert select.select([transport._fd], [], [], 10.0)[0]
    transport.pause(0.001)
    assert taker.data == b"rest of a reply"


async def test_paused_port_can_be_closed(port: tuple[PosixSerial, Taker, int]) -> None:
    transport, taker, peer = port
    transport.pause(SHORT_PAUSE + 0.001)
    transport.close()
    os.write(peer, b"late")
    await asyncio.sleep(0.01)
    assert taker.data == b""


async def test_port_that_accepts_no_bytes_is_an_error(
    port: tuple[PosixSerial, Taker, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serial_posix, "SEND_TIMEOUT", 0.05)
    with pytest.raises(OSError, match="the port accepts no bytes"):
        async with asyncio.timeout(20):
            await port[0].send(bytes(1_000_000))
