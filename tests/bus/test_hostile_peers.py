"""Peers that never stop sending, or reply before a request."""

from __future__ import annotations

import asyncio
import os
import pty
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.limits import FROZEN_IN_SENDING
from tui.bus.api import Priority
from tui.bus.errors import LineError
from tui.bus.link import Link, RtuTcpLink, TcpLink
from tui.bus.master import LineContext, Piece, ResultKind, Sending
from tui.bus.requests import Read
from tui.bus.rtu.exchange import FLOOD, RtuExchange
from tui.bus.rtu.master import RtuMaster
from tui.bus.tally import Tally
from tui.bus.tcp.master import TcpMaster
from tui.bus.trace import Trace
from tui.bus.transport.base import Receiver
from tui.bus.transport.serial_posix import PosixSerial
from tui.bus.transport.tcp import TcpTransport

from .conftest import BRISK, OpenLine
from .peer import honest_pdu, reply, tcp_reply

REQUEST = Read(1, 5, 1)
QUESTION = bytes([3, 0, 5, 0, 1])


class CommandBlocked:
    """A transport with received bytes that are still in the system."""

    note = ""

    def __init__(self, held: bytes) -> None:
        self.held = held
        self.sent: list[bytes] = []
        self._receiver: Receiver | None = None

    def start(self, receiver: Receiver) -> None:
        self._receiver = receiver

    def _hand_over(self) -> None:
        held, self.held = self.held, b""
        if held and self._receiver is not None:
            self._receiver.received(held, time.monotonic())

    async def send(self, data: bytes) -> None:
        self.sent.append(data)
        # as the loop does in its next turn
        asyncio.get_running_loop().call_soon(self._hand_over)

    async def rest(self, until: float) -> None:
        await asyncio.sleep(max(0.0, until - time.monotonic()))

    async def take_in(self) -> None:
        self._hand_over()

    def close(self) -> None:
        self._receiver = None


def context(strays: list[Piece]) -> LineContext:
    trace = Trace(50)
    return LineContext(BRISK, trace, Tally(), time.monotonic, lambda piece, _: strays.append(piece))


async def test_bytes_before_a_request_are_not_its_reply() -> None:
    strays: list[Piece] = []
    transport = CommandBlocked(reply(b"\x01" + QUESTION + b"\0\0"))
    around = context(strays)
    master = RtuMaster(transport, RtuTcpLink("x", 1), around, lambda: None, wire_time=False)
    result = await master.exchange(Sending(1, QUESTION, REQUEST.expectation(), 0.05))
    assert result.kind is ResultKind.NOTHING
    assert [piece.whole for piece in strays] == [True]
    assert around.tally.stale == 1
    master.close()


async def test_reply_counts_after_a_pause_in_sending_that_is_no_suspension() -> None:
    transport, around = CommandBlocked(b""), context([])
    master = RtuMaster(transport, RtuTcpLink("x", 1), around, lambda: None, wire_time=False)

    def pause() -> None:
        time.sleep(FROZEN_IN_SENDING * 0.6)
        transport.held = reply(b"\x01" + QUESTION + b"\0\0")

    requested = Sending(1, QUESTION, REQUEST.expectation(), 0.5, look=pause)
    result = await master.exchange(requested)
    assert result.kind is ResultKind.REPLY
    master.close()


async def test_bytes_received_while_suspended_in_sending_are_not_a_reply() -> None:
    """Frozen between its read of the line and the request: an earlier reply is already there."""
    strays: list[Piece] = []
    transport = CommandBlocked(b"")
    around = context(strays)
    master = RtuMaster(transport, RtuTcpLink("x", 1), around, lambda: None, wire_time=False)

    def freeze() -> None:
        time.sleep(FROZEN_IN_SENDING + 0.05)
        transport.held = reply(b"\x01" + QUESTION + b"\0\0")

    requested = Sending(1, QUESTION, REQUEST.expectation(), 0.05, look=freeze)
    result = await master.exchange(requested)
    assert result.kind is ResultKind.NOTHING
    await master.quiet()
    # nor a copy of one, after which its drive would count as repeating itself
    assert strays == []
    assert around.tally.stale == 1
    # sent anyway, which a write must know
    assert len(transport.sent) == 1
    master.close()


async def test_bytes_before_a_request_with_a_guessed_transaction_are_not_a_reply() -> None:
    """Transaction ids of a client increase, so anyone can guess the next one."""
    transport = CommandBlocked(tcp_reply(bytes([0, 1, 0, 0, 0, 6, 1]) + QUESTION))
    around = context([])
    master = TcpMaster(transport, around, lambda: None)
    result = await master.exchange(Sending(1, QUESTION, REQUEST.expectation(), 0.05))
    assert result.kind is ResultKind.NOTHING
    assert around.tally.stale == 1
    # the next one has its answer
    transport.held = tcp_reply(bytes([0, 2, 0, 0, 0, 6, 1]) + QUESTION)
    honest_send = transport.send
    late, transport.held = transport.held, b""

    async def send(data: bytes) -> None:
        transport.held = late
        await honest_send(data)

    transport.send = send  # type: ignore[method-assign]
    result = await master.exchange(Sending(1, QUESTION, REQUEST.expectation(), 5.0))
    assert (result.kind, result.pdu) == (ResultKind.REPLY, honest_pdu(QUESTION))
    master.close()


class Taker:
    """Collects the bytes that a transport delivers."""

    def __init__(self) -> None:
        self.data = b""

    def received(self, data: bytes, time: float) -> None:
        self.data += data

    def lost(self, reason: str) -> None:
        raise AssertionError(reason)


async def test_take_in_reads_pending_bytes_of_a_connection() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = await TcpTransport.connect("127.0.0.1", server.getsockname()[1], 5.0)
        other, _ = server.accept()
        with other:
            taker = Taker()
            transport.start(taker)
            await asyncio.sleep(0.01)
            other.sendall(b"early")
            time.sleep(0.05)  # noqa: ASYNC251 - the loop must not run in this time
            await transport.take_in()
            assert taker.data == b"early"
            transport.close()


@pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")
async def test_take_in_reads_pending_bytes_of_a_port() -> None:
    import serial

    master, slave = pty.openpty()
    tty.setraw(slave)
    transport = PosixSerial(serial.Serial(os.ttyname(slave), timeout=0))
    taker = Taker()
    transport.start(taker)
    try:
        os.write(master, b"early")
        await transport.take_in()
        assert taker.data == b"early"
        await transport.take_in()  # nothing is nothing
    finally:
        transport.close()
        os.close(master)
        os.close(slave)


@given(
    lumps=st.lists(st.integers(1, 3000), min_size=1, max_size=12),
    filler=st.sampled_from([b"\x01", b"\x01\x03", b"\x01\x03\x02", b"\xff", b"\0"]),
)
def test_reply_after_a_flood_is_found_and_the_flood_is_dropped(
    lumps: list[int], filler: bytes
) -> None:
    exchange = RtuExchange(b"\x01" + QUESTION + b"\0\0", REQUEST.expectation(), echo=False)
    for length in lumps:
        assert exchange.feed((filler * length)[:length]) is None
        assert len(exchange.buffer) <= FLOOD
    whole = reply(b"\x01" + QUESTION + b"\0\0")
    found = [exchange.feed(bytes([byte])) for byte in whole]
    assert found[:-1] == [None] * (len(whole) - 1)
    last = found[-1]
    assert last is not None
    assert last.pdu == honest_pdu(QUESTION)


@contextmanager
def flooding(junk: bytes, pause: float = 0.0) -> Iterator[int]:
    """The port of a server that sends the same over and over, and reads nothing."""
    over = threading.Event()

    def pour(other: socket.socket) -> None:
        with other, suppress(OSError):
            while not over.is_set():
                other.sendall(junk)
                if pause:
                    time.sleep(pause)

    def serve(server: socket.socket) -> None:
        with suppress(OSError):
            while not over.is_set():
                other, _ = server.accept()
                threading.Thread(target=pour, args=(other,), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=serve, args=(server,), daemon=True).start()
        try:
            yield server.getsockname()[1]
        finally:
            over.set()


RTU: Callable[[int], Link] = lambda port: RtuTcpLink("127.0.0.1", port)  # noqa: E731
TCP: Callable[[int], Link] = lambda port: TcpLink("127.0.0.1", port)  # noqa: E731
FLOODS = {
    "noise": (RTU, os.urandom(60_000), 0.0),
    "beginnings of replies": (RTU, b"\x01\x03\x02" * 20_000, 0.0),
    "byte after byte": (RTU, b"\x01", 0.0005),
    "noise at the speed of a line": (RTU, b"\x01\x03\x02\x55" * 5, 0.004),
    "answers to nobody": (TCP, b"\x77\x77\0\0\0\3\1\x83\2" * 7000, 0.0),
    "no Modbus": (TCP, os.urandom(60_000), 0.0),
    "an answer without end": (TCP, b"\0\1\0\0\0\xfe\1\3", 0.5),
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize("name", FLOODS)
async def test_requests_end_on_a_line_that_never_pauses(name: str, open_line: OpenLine) -> None:
    """Before, the search for a reply in all received bytes blocked the loop of the line for
    minutes.
    """
    link, junk, pause = FLOODS[name]
    with flooding(junk, pause) as port:
        line = open_line(link(port), BRISK, wait=None)
        for priority in (Priority.OPERATOR_READ, Priority.STOP):
            with pytest.raises(LineError):
                await line.read(1, 5, priority=priority)
        with pytest.raises(LineError):
            await line.write(1, 5, [1], priority=Priority.STOP)
