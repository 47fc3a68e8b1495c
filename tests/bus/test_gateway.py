"""Modbus TCP server: requests parsed strictly, and replies that keep their transaction."""

from __future__ import annotations

import asyncio
import socket
import struct
import time
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.bus.gateway import server, talk
from tui.bus.gateway.pdu import (
    IdentifyRequested,
    ReadRequested,
    Unanswerable,
    WriteRequested,
    exception_pdu,
    identified_pdu,
    parse_request,
    words_pdu,
    written_pdu,
)
from tui.bus.gateway.room import ServedConnection, host_of, makes_room
from tui.bus.gateway.server import HEADER, Awake, TcpGateway, TcpRequest
from tui.bus.gateway.talk import MOST_AT_ONCE, peer_text
from tui.wire.frames import wire_place


def test_requests_of_each_function_are_parsed() -> None:
    assert parse_request(bytes.fromhex("03 0C81 0002")) == ReadRequested(3, 3201, 2)
    assert parse_request(bytes.fromhex("04 0000 007D")) == ReadRequested(4, 0, 125)
    assert parse_request(bytes.fromhex("06 2135 0007")) == WriteRequested(6, 8501, (7,))
    many = parse_request(bytes.fromhex("10 2135 0002 04 000F 01F4"))
    assert many == WriteRequested(16, 8501, (15, 500))
    assert isinstance(many, WriteRequested)
    assert many.words == {8501: 15, 8502: 500}
    both = parse_request(bytes.fromhex("17 0C81 0001 2135 0001 02 0007"))
    assert both == WriteRequested(23, 8501, (7,), 3201, 1)
    assert parse_request(bytes.fromhex("2B 0E 01 00")) == IdentifyRequested(1, 0)
    assert parse_request(bytes.fromhex("02 0003 0009")) == ReadRequested(2, 3, 9)
    coil = wire_place(1, 3)
    assert parse_request(bytes.fromhex("05 0003 FF00")) == WriteRequested(5, coil, (1,))
    coils = parse_request(bytes.fromhex("0F 0003 0009 02 03 01"))
    assert isinstance(coils, WriteRequested)
    assert coils == WriteRequested(15, coil, (1, 1, 0, 0, 0, 0, 0, 0, 1))
    assert 3 not in coils.words, "register 3 is another"


@pytest.mark.parametrize(
    ("pdu", "code"),
    [
        ("01 0000 007E", 3),
        ("02 FFFF 0002", 2),
        ("05 0000 0001", 3),
        ("05 0000 FF00 00", 3),
        ("0F 0000 0009 01 01", 3),
        ("0F 0000 0000 00", 3),
        ("0F FFFF 0002 01 01", 2),
        ("16 0000 00F2 0025", 1),
        ("2B 0D 01 00", 1),
        ("03 0000 007E", 3),
        ("03 0000 0000", 3),
        ("03 FFFF 0002", 2),
        ("03 0000", 3),
        ("06 2135 0007 00", 3),
        ("10 2135 0002 02 000F", 3),
        ("10 2135 0001 04 000F 01F4", 3),
        ("10 2135 0001 02 00", 3),
        ("17 0C81 0001 2135 0002 02 0007", 3),
        ("2B 0E 05 00", 3),
    ],
)
def test_malformed_request_is_refused(pdu: str, code: int) -> None:
    with pytest.raises(Unanswerable) as refused:
        parse_request(bytes.fromhex(pdu))
    assert refused.value.code == code


@given(st.binary(min_size=1, max_size=253))
def test_parsing_random_bytes_raises_unanswerable_only(pdu: bytes) -> None:
    with suppress(Unanswerable):
        parse_request(pdu)


def test_replies_are_encoded_as_bytes() -> None:
    assert words_pdu(3, [0x0237, 0]) == bytes.fromhex("03 04 0237 0000")
    assert written_pdu(WriteRequested(6, 8501, (7,))) == bytes.fromhex("06 2135 0007")
    assert written_pdu(WriteRequested(16, 8501, (7, 8))) == bytes.fromhex("10 2135 0002")
    assert words_pdu(2, [1, 0, 0, 0, 0, 0, 0, 0, 1]) == bytes.fromhex("02 02 01 01")
    assert written_pdu(WriteRequested(5, wire_place(1, 3), (1,))) == bytes.fromhex("05 0003 FF00")
    assert written_pdu(WriteRequested(15, wire_place(1, 3), (1, 0))) == bytes.fromhex(
        "0F 0003 0002"
    )
    assert exception_pdu(16, 11) == bytes.fromhex("90 0B")


def test_long_identification_continues_at_the_next_object() -> None:
    objects = {0: b"T" * 100, 1: b"A" * 100, 2: b"V" * 100}
    first = identified_pdu(IdentifyRequested(1, 0), 0x81, objects)
    assert first[:7] == bytes.fromhex("2B 0E 01 81 FF 02 02")
    rest = identified_pdu(IdentifyRequested(1, 2), 0x81, objects)
    assert rest == bytes.fromhex("2B 0E 01 81 00 00 01 02 64") + b"V" * 100
    with pytest.raises(Unanswerable):
        identified_pdu(IdentifyRequested(4, 9), 0x81, objects)


# The server


async def _requested(writer: asyncio.StreamWriter, transaction: int, unit: int, pdu: bytes) -> None:
    writer.write(HEADER.pack(transaction, 0, len(pdu) + 1, unit) + pdu)
    await writer.drain()


async def _answer(reader: asyncio.StreamReader) -> tuple[int, int, bytes]:
    transaction, _, length, unit = HEADER.unpack(await reader.readexactly(HEADER.size))
    return transaction, unit, await reader.readexactly(length - 1)


async def test_queued_requests_get_replies_with_their_own_transaction_ids() -> None:
    """The first reply takes long; the second request arrives in that time."""
    free = asyncio.Event()

    async def answer(request: TcpRequest) -> bytes:
        if request.unit == 1:
            await free.wait()
        return bytes([3, 2, 0, request.unit])

    gateway = TcpGateway(answer)
    reader, writer = await asyncio.open_connection(*await gateway.listen("127.0.0.1", 0))
    read = struct.pack(">BHH", 3, 0, 1)
    await _requested(writer, 7, 1, read)
    await _requested(writer, 8, 2, read)
    await asyncio.sleep(0.05)
    free.set()
    assert await _answer(reader) == (7, 1, bytes([3, 2, 0, 1]))
    assert await _answer(reader) == (8, 2, bytes([3, 2, 0, 2]))
    writer.close()
    await gateway.close()


async def test_write_does_not_wait_for_earlier_reads() -> None:
    """It may be a stop, and the drive before it may be silent."""
    free = asyncio.Event()

    async def answer(request: TcpRequest) -> bytes:
        if request.pdu[0] == 3:
            await free.wait()
            return bytes([3, 2, 0, 0])
        return request.pdu

    gateway = TcpGateway(answer)
    reader, writer = await asyncio.open_connection(*await gateway.listen("127.0.0.1", 0))
    await _requested(writer, 1, 1, struct.pack(">BHH", 3, 0, 1))
    stop = struct.pack(">BHH", 6, 8501, 7)
    await _requested(writer, 2, 1, stop)
    assert await asyncio.wait_for(_answer(reader), 30) == (2, 1, stop)
    free.set()
    assert (await _answer(reader))[0] == 1
    writer.close()
    await gateway.close()


async def test_urgent_write_overtakes_earlier_writes() -> None:
    """A stop does, whatever the drive before it takes to be silent."""
    free = asyncio.Event()

    async def answer(request: TcpRequest) -> bytes:
        if request.unit == 1:
            await free.wait()
        if request.unit == 2:
            await request.turn()
        return request.pdu

    gateway = TcpGateway(answer)
    reader, writer = await asyncio.open_connection(*await gateway.listen("127.0.0.1", 0))
    write = struct.pack(">BHH", 6, 8501, 7)
    for number in (1, 2, 3):
        await _requested(writer, number, number, write)
    assert (await asyncio.wait_for(_answer(reader), 30))[0] == 3
    free.set()
    assert [(await _answer(reader))[0] for _ in range(2)] == [1, 2]
    writer.close()
    await gateway.close()


async def test_queued_reads_do_not_delay_a_write_in_the_socket() -> None:
    """Further requests are refused with busy: a stop may follow them."""
    free = asyncio.Event()

    async def answer(request: TcpRequest) -> bytes:
        if request.pdu[0] == 3:
            await free.wait()
        return request.pdu

    gateway = TcpGateway(answer)
    reader, writer = await asyncio.open_connection(*await gateway.listen("127.0.0.1", 0))
    for number in range(MOST_AT_ONCE + 2):
        await _requested(writer, number, 1, bytes([3, 0, 0, 0, 1]))
    stop = struct.pack(">BHH", 6, 8501, 7)
    await _requested(writer, 999, 1, stop)
    answers = [await asyncio.wait_for(_answer(reader), 30) for _ in range(3)]
    assert [pdu for number, _, pdu in answers if number != 999] == [bytes([0x83, 6])] * 2
    assert (999, 1, stop) in answers
    free.set()
    writer.close()
    await gateway.close()


async def test_request_sent_before_close_is_carried_out() -> None:
    done: list[bytes] = []
    both = asyncio.Event()

    async def answer(request: TcpRequest) -> bytes:
        await asyncio.sleep(0.05)
        await request.turn()
        done.append(request.pdu)
        if len(done) == 2:
            both.set()
        return request.pdu

    gone = asyncio.Event()
    gateway = TcpGateway(answer, lambda _: gone.set())
    _, writer = await asyncio.open_connection(*await gateway.listen("127.0.0.1", 0))
    for word in (15, 7):
        await _requested(writer, word, 1, struct.pack(">BHH", 6, 8501, word))
    writer.close()
    await asyncio.wait_for(both.wait(), 30)
    assert [pdu[-1] for pdu in done] == [15, 7]
    await asyncio.wait_for(gone.wait(), 30)
    await gateway.close()


async def test_requests_delayed_by_a_suspended_loop_are_recognized() -> None:
    stale: list[bool] = []
    now = 100.0
    awake = Awake(lambda: now)

    async def answer(request: TcpRequest) -> bytes:
        stale.append(request.stale)
        return request.pdu

    gateway = TcpGateway(answer, awake=awake)
    reader, writer = await asyncio.open_connection(*await gateway.listen("127.0.0.1", 0))
    for moment in (100.0, 104.0, 104.5, 105.5):
        now = moment
        if moment != 104.0:
            awake.look()
        await _requested(writer, 1, 1, struct.pack(">BHH", 6, 8501, 15))
        await _answer(reader)
    assert stale == [False, True, True, False]
    writer.close()
    await gateway.close()


@pytest.mark.internal_errors
async def test_waiting_client_does_not_block_other_clients() -> None:
    gone: list[str] = []

    async def answer(request: TcpRequest) -> bytes:
        if request.unit == 1:
            await asyncio.Event().wait()
        if request.unit == 2:
            raise KeyError("a fault of the program")
        return bytes([3, 2, 0, request.unit])

    gateway = TcpGateway(answer, lambda client: gone.append(client.peer))
    place = await gateway.listen("127.0.0.1", 0)
    _, stuck = await asyncio.open_connection(*place)
    await _requested(stuck, 1, 1, bytes([3, 0, 0, 0, 1]))
    reader, writer = await asyncio.open_connection(*place)
    await _requested(writer, 2, 2, bytes([3, 0, 0, 0, 1]))
    assert await _answer(reader) == (2, 2, bytes([0x83, 4]))
    await _requested(writer, 3, 3, bytes([3, 0, 0, 0, 1]))
    assert await _answer(reader) == (3, 3, bytes([3, 2, 0, 3]))
    writer.write(b"GET / HTTP/1.1\r\n\r\n")
    assert await reader.read() == b""
    await gateway.close()
    assert len(gone) == 2
    stuck.close()
    writer.close()


async def test_idle_client_makes_room_for_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Programs that forgot 64 connections kept out the one that was to stop a motor."""
    monkeypatch.setattr(server, "MOST_CLIENTS", 3)
    gone: list[str] = []

    def slow_host_of(peer: object) -> str:
        time.sleep(0.005)  # a busy computer: each connection is looked at later than the one before
        return host_of(peer)

    monkeypatch.setattr(talk, "host_of", slow_host_of)

    async def answer(request: TcpRequest) -> bytes:
        if request.unit == 1:
            await asyncio.Event().wait()
        return request.pdu

    gateway = TcpGateway(answer, lambda client: gone.append(client.peer))
    place = await gateway.listen("127.0.0.1", 0)
    clients = [await asyncio.open_connection(*place) for _ in range(3)]
    for number, (reader, writer) in enumerate(clients, 1):
        # the first waits for its reply: it is not idle, however long that takes
        await _requested(writer, number, number, bytes([3, 0, 0, 0, 1]))
        if number > 1:
            await _answer(reader)
    for number in (4, 5):
        reader, writer = await asyncio.open_connection(*place)
        clients.append((reader, writer))
        await _requested(writer, number, number, bytes([6, 0x21, 0x35, 0, 7]))
        assert await _answer(reader) == (number, number, bytes([6, 0x21, 0x35, 0, 7]))
    names = [peer_text(writer.get_extra_info("sockname")) for _, writer in clients]
    assert gone == names[1:3], "in the order of their last requests, and not the one that waits"
    await gateway.close()
    assert sorted(gone) == sorted(names)
    for _, writer in clients:
        writer.close()


async def test_connections_of_other_hosts_do_not_keep_a_client_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(server, "MOST_CLIENTS", 4)
    go_on = asyncio.Event()

    async def answer(request: TcpRequest) -> bytes:
        await go_on.wait()
        return request.pdu

    gateway = TcpGateway(answer)
    place = await gateway.listen("127.0.0.1", 0)

    async def client(host: str, function: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        made = await asyncio.open_connection(*place, local_addr=(host, 0))
        await _requested(made[1], 1, 1, bytes([function, 0, 0, 0, 1]))
        await asyncio.sleep(0.05)
        return made

    busy = [await client("127.0.0.2", function) for function in (3, 6, 3, 3)]
    other = await client("127.0.0.3", 6)
    assert await busy[0][0].read() == b"", "the address with the most gives one"
    third = await client("127.0.0.2", 3)
    assert await busy[2][0].read() == b"", "for one more of its own, too; not one that writes"
    go_on.set()
    for reader, _ in (busy[1], busy[3], other, third):
        assert (await _answer(reader))[0] == 1
    for _, writer in (*busy, other, third):
        writer.close()
    await gateway.close()


async def test_connections_waiting_for_writes_do_not_keep_a_client_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """64 connections of one host did, and the next one was to stop a motor."""
    monkeypatch.setattr(server, "MOST_CLIENTS", 2)
    monkeypatch.setattr(server, "MOST_LEAVING", 2)
    done: list[int] = []
    go_on = asyncio.Event()

    async def answer(request: TcpRequest) -> bytes:
        if request.pdu[-1] < 9:
            await go_on.wait()
        done.append(request.pdu[-1])
        return request.pdu

    gateway = TcpGateway(answer)
    place = await gateway.listen("127.0.0.1", 0)
    clients = []
    for number in range(4):
        clients.append(await asyncio.open_connection(*place, local_addr=("127.0.0.2", 0)))
        await _requested(clients[-1][1], 1, 1, bytes([6, 0, 0, 0, number]))
        await asyncio.sleep(0.05)
    assert [await reader.read() for reader, _ in clients[:2]] == [b"", b""]
    reader, writer = await asyncio.open_connection(*place, local_addr=("127.0.0.3", 0))
    await _requested(writer, 7, 1, bytes([6, 0, 0, 0, 9]))
    assert (await _answer(reader))[0] == 7
    go_on.set()
    assert (await _answer(clients[3][0]))[0] == 1
    await asyncio.sleep(0.1)
    # what they had sent is carried out, but for the oldest: each could send more and more
    assert sorted(done) == [1, 2, 3, 9]
    for _, stream_writer in (*clients, (reader, writer)):
        stream_writer.close()
    await gateway.close()


async def test_replies_to_a_disconnected_client_are_dropped_silently(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """A client that was killed left as many complaints as requests in the log of a service."""
    gone, requested, go_on = asyncio.Event(), asyncio.Event(), asyncio.Event()
    count = 0

    async def answer(request: TcpRequest) -> bytes:
        nonlocal count
        count += 1
        if count == 20:
            requested.set()
        await go_on.wait()
        return request.pdu

    gateway = TcpGateway(answer, lambda _: gone.set())
    _, writer = await asyncio.open_connection(*await gateway.listen("127.0.0.1", 0))
    for number in range(20):
        await _requested(writer, number, 1, struct.pack(">BHH", 6, 8501, 7))
    await asyncio.wait_for(requested.wait(), 30)
    its_socket = writer.get_extra_info("socket")
    its_socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()  # a reset, as of a program that was killed
    await asyncio.sleep(0.2)
    go_on.set()
    await asyncio.wait_for(gone.wait(), 30)
    await gateway.close()
    assert not [record for record in caplog.records if record.name == "asyncio"]


def test_host_with_most_connections_loses_one() -> None:
    here = {
        1: ServedConnection("a", 1.0),
        2: ServedConnection("a", 2.0),
        3: ServedConnection("b", 9.0),
        4: ServedConnection("a", 8.0, writes=True),
    }
    assert makes_room("c", here) == 2
    assert makes_room("a", here) == 2
    del here[1]
    assert makes_room("b", here) == 3, "each would have two: it was idle for longest"
    assert makes_room("c", {4: here[4]}) == 4, "one that writes goes last"
