"""Modbus TCP and RTU over TCP on loopback."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from tui.bus.api import LineStatus, Priority
from tui.bus.errors import ChecksumFault, DeviceException, LineLost, NoAnswer, WrongReply
from tui.bus.limits import CAUTIOUS
from tui.bus.line import Timing
from tui.bus.link import RtuTcpLink, TcpLink
from tui.bus.prepared import prepared_write
from tui.bus.transport import tcp as tcp_module
from tui.bus.transport.tcp import TcpTransport

from .conftest import BRISK, WIDE, OpenLine
from .peer import Step, TcpPeer, eventually, honest, reply, tcp_reply, tcp_request_length
from .plain import outcome, plain_tcp

OPERATOR = Priority.OPERATOR_READ


def tcp_honest(request: bytes, _count: int) -> Sequence[Step]:
    return [tcp_reply(request)] if request[6] else []


def other_unit(request: bytes) -> bytes:
    whole = bytearray(tcp_reply(request))
    whole[6] = 99
    return bytes(whole)


WRONG: dict[str, Callable[[bytes], bytes]] = {
    "another function": lambda request: tcp_reply(request, bytes([4, 2, 0, 9])),
    "too few words": lambda request: tcp_reply(request, bytes([3, 0])),
    "too many words": lambda request: tcp_reply(request, bytes([3, 4, 0, 9, 0, 9])),
    "a length that lies": lambda request: tcp_reply(request, bytes([3, 2, 0, 9, 0])),
}


async def test_gateway_that_returns_no_transaction_id_is_reported(open_line: OpenLine) -> None:
    def without_id(request: bytes, _count: int) -> Sequence[Step]:
        return [bytes(2) + tcp_reply(request)[2:]]

    with TcpPeer(without_id, length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port))
        with pytest.raises(WrongReply, match="does not return the transaction id"):
            await line.read(1, 5)


@pytest.mark.parametrize("case", ["another function", "too few words", "too many words"])
async def test_plain_client_accepts_a_wrong_reply(case: str) -> None:
    with TcpPeer(lambda request, _: [WRONG[case](request)], length=tcp_request_length) as peer:
        async with plain_tcp(peer.port) as client:
            got = await outcome(client.read_holding_registers(5, count=1, device_id=1))
    assert got is not None


@pytest.mark.parametrize("case", WRONG)
async def test_wrong_reply_is_discarded(case: str, open_line: OpenLine) -> None:
    with TcpPeer(lambda request, _: [WRONG[case](request)], length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port))
        with pytest.raises(WrongReply):
            await line.read(1, 5)


async def test_dead_network_is_detected_without_requests() -> None:
    with TcpPeer(tcp_honest, length=tcp_request_length) as peer:
        transport = await TcpTransport.connect("127.0.0.1", peer.port, 5.0)
        assert transport._connection is not None
        connection: socket.socket = transport._connection.get_extra_info("socket")
        assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
        options = ("TCP_KEEPIDLE", "TCP_KEEPINTVL", "TCP_KEEPCNT", "TCP_USER_TIMEOUT")
        found = {
            name: connection.getsockopt(socket.IPPROTO_TCP, getattr(socket, name))
            for name in options
            if hasattr(socket, name)  # not on every system
        }
        expected = dict(zip(options, (10, 5, 3, 5000), strict=True))
        assert found == {name: expected[name] for name in found}
        transport._connection.close()


async def test_reply_of_another_unit_is_discarded(open_line: OpenLine) -> None:
    with TcpPeer(lambda request, _: [other_unit(request)], length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port))
        with pytest.raises(WrongReply, match="unit 99"):
            await line.read(1, 5)


async def test_reply_of_another_transaction_is_skipped(open_line: OpenLine) -> None:
    def script(request: bytes, _count: int) -> Sequence[Step]:
        other = (int.from_bytes(request[:2], "big") - 1) % 0x10000
        return [tcp_reply(request, bytes([3, 2, 0, 9]), transaction=other), tcp_reply(request)]

    with TcpPeer(script, length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port))
        assert (await line.read(1, 5)).words == (5,)
        assert line.counters.stale == 1


async def test_late_replies_do_not_shift_later_replies(open_line: OpenLine) -> None:
    def late(request: bytes, count: int) -> Sequence[Step]:
        return [0.4 if count == 0 else 0.0, tcp_reply(request)]

    with TcpPeer(late, length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port), BRISK)
        with pytest.raises(NoAnswer):
            await line.read(1, 10, priority=OPERATOR)
        for address in (20, 30):
            try:
                got = await line.read(1, address, priority=OPERATOR)
            except NoAnswer:
                continue
            assert got.words == (address,)
        assert (await line.read(1, 40, priority=OPERATOR)).words == (40,)


async def test_reply_to_every_function_is_accepted(open_line: OpenLine) -> None:
    with TcpPeer(tcp_honest, length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port))
        assert (await line.read(1, 5, 3)).words == (5, 6, 7)
        await line.write(1, 5, [7])
        await line.write(1, 5, [7, 8, 9])
        assert (await line.read_write(1, 5, 2, 9, [1, 2, 3])).words == (5, 6)
        assert await line.diagnose(1, 0, 0x1234) == 0x1234
        assert (await line.identify(1)).objects == {0: b"none"}
        await line.broadcast(5, [1], limits=WIDE)
        assert (await line.read(1, 5)).words == (5,)
        assert line.counters.requests == 8
        assert line.counters.replies == 7


async def test_reply_that_arrives_byte_by_byte_is_found(open_line: OpenLine) -> None:
    def crumbs(request: bytes, _count: int) -> Sequence[Step]:
        whole = tcp_reply(request)
        return [step for byte in whole for step in (bytes([byte]), 0.005)]

    with TcpPeer(crumbs, length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port))
        assert (await line.read(1, 5, 2)).words == (5, 6)


async def test_refusal_raises_and_gateway_exception_means_no_answer(open_line: OpenLine) -> None:
    codes = {1: 2, 77: 11}

    def refuse(request: bytes, _count: int) -> Sequence[Step]:
        return [tcp_reply(request, bytes([0x83, codes[request[6]]]))]

    with TcpPeer(refuse, length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port))
        with pytest.raises(DeviceException) as refused:
            await line.read(1, 5)
        assert refused.value.code == 2
        with pytest.raises(NoAnswer, match="gateway"):
            await line.read(77, 5, priority=OPERATOR)
        assert 11 in CAUTIOUS.exceptions


@pytest.mark.parametrize("case", ["no protocol", "half a reply"])
async def test_connection_with_garbage_is_reopened(case: str, open_line: OpenLine) -> None:
    garbage = b"HTTP/1.0 400 Bad Request" if case == "no protocol" else b"\0\1\0\0\0\x09\1\3"
    script: dict[str, type[Exception]] = {"no protocol": LineLost, "half a reply": NoAnswer}
    timing = Timing(first_timeout=0.3, min_timeout=0.3, reconnect_first=0.1, retries=0)
    with TcpPeer(lambda _request, _count: [garbage], length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port), timing)
        with pytest.raises(script[case]):
            await line.read(1, 5, priority=OPERATOR)
        await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.LOST)
        peer.script = tcp_honest
        await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.CONNECTED)
        assert (await line.read(1, 5, priority=OPERATOR)).words == (5,)


async def test_rtu_over_tcp_reads_and_writes(open_line: OpenLine) -> None:
    with TcpPeer(honest) as peer:
        line = open_line(RtuTcpLink("127.0.0.1", peer.port))
        got = await asyncio.gather(*(line.read(1, address) for address in range(20)))
        assert [each.words for each in got] == [(address,) for address in range(20)]
        await line.write(1, 5, [7])
        await line.broadcast(5, [1], limits=WIDE)


async def test_rtu_over_tcp_survives_late_and_damaged_replies(open_line: OpenLine) -> None:
    def script(request: bytes, count: int) -> Sequence[Step]:
        whole = reply(request)
        steps: list[list[Step]] = [[0.35, whole], [whole[:4]], [b"\0" + whole]]
        return steps[count]

    with TcpPeer(script) as peer:
        line = open_line(RtuTcpLink("127.0.0.1", peer.port), BRISK)
        with pytest.raises(NoAnswer):
            await line.read(1, 10, priority=OPERATOR)
        with pytest.raises(ChecksumFault):
            await line.read(1, 20, priority=OPERATOR)
        assert (await line.read(1, 30, priority=OPERATOR)).words == (30,)


@pytest.mark.parametrize("unit", [255, 0])
async def test_requests_to_the_only_drive_of_a_gateway_have_its_unit(
    open_line: OpenLine, unit: int
) -> None:
    def only(request: bytes, _count: int) -> Sequence[Step]:
        return [tcp_reply(request)] if request[6] == unit else []

    with TcpPeer(only, length=tcp_request_length) as peer:
        link = TcpLink("127.0.0.1", peer.port, unit=unit)
        line = open_line(link)
        assert (await line.read(1, 100, priority=OPERATOR)).words == (100,)
        with pytest.raises(NoAnswer):
            await line.read(2, 100, priority=OPERATOR)
        assert [request[6] for request in peer.requests[:2]] == [unit, 2]
    assert prepared_write(link, WIDE, 1, 8501, [0]).frame[6] == unit
    assert prepared_write(link, WIDE, 2, 8501, [0]).frame[6] == 2


async def test_reply_with_the_device_address_instead_of_the_unit_is_rejected(
    open_line: OpenLine,
) -> None:
    def number(request: bytes, _count: int) -> Sequence[Step]:
        whole = bytearray(tcp_reply(request))
        whole[6] = 1
        return [bytes(whole)]

    with TcpPeer(number, length=tcp_request_length) as peer:
        line = open_line(TcpLink("127.0.0.1", peer.port, unit=255))
        with pytest.raises(WrongReply, match="unit 1"):
            await line.read(1, 100)


# -- a connection, step by step --------------------------------------------------------------------


class Connected(asyncio.Transport):
    """A connection that writes into a list."""

    def __init__(self) -> None:
        super().__init__({"socket": self})
        self.written: list[bytes] = []
        self.closing = self.aborted = False

    def setsockopt(self, *option: int) -> None:
        """Any option is accepted."""

    def is_closing(self) -> bool:
        return self.closing

    def write(self, data: Any) -> None:
        self.written.append(bytes(data))

    def abort(self) -> None:
        self.aborted = True


class Heard:
    """A receiver that keeps all it gets."""

    def __init__(self) -> None:
        self.got: list[object] = []

    def received(self, data: bytes, at: float) -> None:
        assert abs(time.monotonic() - at) < 60.0
        self.got.append(data)

    def lost(self, reason: str) -> None:
        self.got.append(reason)


async def test_frame_is_sent_on_an_open_connection_only() -> None:
    transport, connection = TcpTransport(), Connected()
    with pytest.raises(OSError, match="the connection is closed"):
        await transport.send(b"never connected")
    transport.connection_made(connection)
    await transport.send(b"frame")
    assert connection.written == [b"frame"]
    connection.closing = True
    with pytest.raises(OSError, match="the connection is closed"):
        await transport.send(b"while it is closing")
    connection.closing = False
    transport.close()
    assert connection.aborted
    transport.close()
    with pytest.raises(OSError, match="the connection is closed"):
        await transport.send(b"after it was closed")
    assert connection.written == [b"frame"]


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (None, "the other end closed"),
        (OSError("no route"), "the connection was lost (no route)"),
    ],
)
async def test_end_of_a_connection_is_reported_once_with_its_reason(
    error: Exception | None, reason: str
) -> None:
    transport, heard = TcpTransport(), Heard()
    transport.connection_made(Connected())
    transport.start(heard)
    transport.data_received(b"reply")
    transport.connection_lost(error)
    transport.connection_lost(error)
    transport.data_received(b"of another")
    assert heard.got == [b"reply", reason]
    with pytest.raises(OSError, match="the connection is closed"):
        await transport.send(b"frame")


def test_early_bytes_are_passed_on_once() -> None:
    transport, first, second = TcpTransport(), Heard(), Heard()
    transport.connection_made(Connected())
    transport.start(second)
    assert second.got == []
    transport = TcpTransport()
    transport.data_received(b"ear")
    transport.data_received(b"ly")
    transport.start(first)
    transport.start(second)
    transport.data_received(b"later")
    assert (first.got, second.got) == ([b"early"], [b"later"])
    ended = TcpTransport()
    ended.data_received(b"a")
    ended.connection_lost(None)
    ended.start(first)
    ended.data_received(b"b")
    assert first.got == [b"early", b"a", "the other end closed"]


def test_closed_connection_reports_nothing_more() -> None:
    transport, heard = TcpTransport(), Heard()
    transport.connection_made(Connected())
    transport.start(heard)
    transport.close()
    transport.data_received(b"late")
    transport.connection_lost(None)
    assert heard.got == []


async def test_rest_lasts_until_its_time_and_not_for_a_time_that_has_passed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slept: list[float] = []

    async def sleep(seconds: float) -> None:
        slept.append(seconds)

    monkeypatch.setattr(tcp_module, "time", SimpleNamespace(monotonic=lambda: 10.0))
    monkeypatch.setattr(tcp_module, "asyncio", SimpleNamespace(sleep=sleep))
    transport = TcpTransport()
    for until in (9.0, 10.0, 10.25):
        await transport.rest(until)
    assert slept == [0.25]
    await transport.take_in()
    assert slept == [0.25, 0, 0], "two turns of the loop"
