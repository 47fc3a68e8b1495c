"""Modbus TCP and RTU over TCP on loopback."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Sequence

import pytest

from tui.bus.api import LineStatus, Priority
from tui.bus.errors import ChecksumFault, DeviceException, LineLost, NoAnswer, WrongReply
from tui.bus.limits import CAUTIOUS
from tui.bus.line import Timing
from tui.bus.link import RtuTcpLink, TcpLink
from tui.bus.prepared import prepared_write
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
