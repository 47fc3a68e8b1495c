"""Coils and discrete inputs on the wire: functions 1, 2, 5 and 15 with pymodbus as the peer."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pymodbus.pdu import DecodePDU
from pymodbus.pdu.bit_message import (
    ReadCoilsResponse,
    ReadDiscreteInputsResponse,
    WriteMultipleCoilsResponse,
    WriteSingleCoilResponse,
)

from tui.bus.coils import (
    ReadCoils,
    ReadDiscrete,
    WriteCoil,
    WriteCoils,
    read_request,
    single_read,
    write_request,
)
from tui.bus.errors import NoAnswer, RequestRefused, WrongReply, request_text
from tui.bus.limits import Limits, send_refusal
from tui.bus.model import Priority
from tui.bus.requests import Read, ReadInput, Request, WriteMany, WriteOne
from tui.bus.rtu.exchange import RtuExchange
from tui.bus.schedule.queue import Job
from tui.bus.share.carried import request_form, request_from
from tui.wire.frames import at_place, frame, wire_place

from .conftest import BRISK, WIDE, OpenLine
from .peer import PtyPeer, honest, honest_pdu, reply, silent

ALL = Limits(
    frozenset({1, 2, 3, 5, 6, 15, 16}), 8, 8, 0, 0, max_read_1=16, max_read_2=12, max_write_15=4
)
BITS = (1, 0, 0, 1, 1, 0, 1, 0, 0, 1, 1)
COIL = wire_place(1, 0)


def pdu(function: int, body: bytes) -> bytes:
    return bytes([function]) + body


@pytest.mark.parametrize("count", [1, 3, 7, 8, 9, 11])
@pytest.mark.parametrize("kind", [ReadCoils, ReadDiscrete])
def test_reply_of_pymodbus_is_the_bits_that_it_holds(kind: type[ReadCoils], count: int) -> None:
    request = kind(1, 5, count)
    heard = DecodePDU(True).decode(request.pdu())
    assert heard is not None
    assert (heard.function_code, heard.address, heard.count) == (kind.function, 5, count)
    response = ReadDiscreteInputsResponse if kind is ReadDiscrete else ReadCoilsResponse
    reply = pdu(kind.function, response(bits=[bool(bit) for bit in BITS[:count]]).encode())
    assert request.expectation().fits(reply)
    assert request.words(reply) == BITS[:count]
    assert request.pdu_of(BITS[:count]) == reply


@pytest.mark.parametrize("request_", [WriteCoil(1, 7, 1), WriteCoil(1, 7, 0)])
def test_one_coil_is_confirmed_by_all_of_its_request(request_: WriteCoil) -> None:
    heard = DecodePDU(True).decode(request_.pdu())
    assert heard is not None
    assert (heard.address, heard.bits) == (7, [bool(request_.value)])
    same = WriteSingleCoilResponse(address=7, bits=[bool(request_.value)])
    other = WriteSingleCoilResponse(address=7, bits=[not request_.value])
    assert request_.expectation().fits(pdu(5, same.encode()))
    assert not request_.expectation().fits(pdu(5, other.encode()))
    assert request_.written == (COIL + 7, (request_.value,))


def test_several_coils_are_confirmed_by_address_and_count() -> None:
    request = WriteCoils(1, 7, BITS)
    heard = DecodePDU(True).decode(request.pdu())
    assert heard is not None
    assert (heard.address, heard.bits) == (7, [bool(bit) for bit in BITS])
    expectation = request.expectation()
    assert expectation.fits(pdu(15, WriteMultipleCoilsResponse(address=7, count=11).encode()))
    assert not expectation.fits(pdu(15, WriteMultipleCoilsResponse(address=7, count=10).encode()))
    assert not expectation.fits(pdu(16, WriteMultipleCoilsResponse(address=7, count=11).encode()))
    assert request.written == (COIL + 7, BITS)


@pytest.mark.parametrize(
    ("request_", "reply"),
    {
        "of function 2": (ReadCoils(1, 0, 3), "02 01 05"),
        "of function 1": (ReadDiscrete(1, 0, 3), "01 01 05"),
        "of registers": (ReadCoils(1, 0, 3), "03 02 00 05"),
        "as many bytes, of registers": (ReadCoils(1, 0, 16), "03 02 00 05"),
        "of more coils": (ReadCoils(1, 0, 8), "01 02 05 00"),
        "of fewer coils": (ReadCoils(1, 0, 9), "01 01 05"),
        "with another byte count": (ReadCoils(1, 0, 9), "01 01 05 00"),
        "a bit beyond the last coil": (ReadCoils(1, 0, 3), "01 01 0D"),
        "a bit beyond the last of nine": (ReadDiscrete(1, 0, 9), "02 02 FF 02"),
        "a coil for registers": (Read(1, 0, 1), "01 02 05 00"),
        "another coil": (WriteCoil(1, 7, 0), "05 00 08 00 00"),
        "a register": (WriteCoil(1, 7, 0), "06 00 07 00 00"),
        "the other value": (WriteCoil(1, 7, 0), "05 00 07 FF 00"),
    }.values(),
)  # fmt: skip
def test_another_reply_is_never_taken(request_: Request, reply: str) -> None:
    data = bytes.fromhex(reply)
    assert not request_.expectation().fits(data)
    assert request_.expectation().mismatch(data)
    exchange = RtuExchange(frame(1, request_.pdu()), request_.expectation(), echo=False)
    assert exchange.feed(frame(1, data)) is None


def test_refusals_are_those_of_their_function() -> None:
    for request in (ReadCoils(1, 0, 3), ReadDiscrete(1, 0, 3), WriteCoil(1, 0, 1)):
        exchange = RtuExchange(frame(1, request.pdu()), request.expectation(), echo=False)
        other = bytes([request.function ^ 3 | 0x80, 2])
        assert exchange.feed(frame(1, other)) is None
        result = exchange.feed(frame(1, bytes([request.function | 0x80, 2])))
        assert result is not None
        assert result.exception == 2


def test_reads_of_as_many_bytes_have_equal_expectations() -> None:
    """Both replies may be one byte: neither proves to which request it belongs."""
    assert ReadCoils(1, 0, 1).expectation() == ReadCoils(1, 4, 8).expectation()
    assert ReadCoils(1, 0, 8).expectation() != ReadCoils(1, 0, 9).expectation()


def test_longer_read_brings_the_coils_that_were_wanted() -> None:
    job = Job(ReadCoils(1, 0, 3), Priority.POLL, ALL)
    job.take_form(ReadCoils(1, 0, 11))
    reply = job.reply(ReadCoils(1, 0, 11).pdu_of(BITS), 0.0)
    assert reply.words == BITS[:3]
    assert job.request.expectation().fits(reply.pdu)


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        (ReadCoils(1, 0, 17), "17 coils or inputs cannot be read at once; the device accepts 16"),
        (ReadDiscrete(1, 0, 13), "the device accepts 12"),
        (WriteCoils(1, 0, (1,) * 5), "the device accepts 4"),
        (WriteCoil(1, 0, 2), "2 does not fit"),
        (WriteCoils(1, 0, (0, -1)), "-1 does not fit"),
        (ReadCoils(1, 65535, 2), "end after register 65535"),
        (WriteCoil(1, 65536, 1), "65536 does not exist"),
        (WriteCoils(0, 0, (0,)), "cannot be broadcast"),
    ],
)
def test_request_beyond_the_limits_is_refused(request_: Request, why: str) -> None:
    assert why in send_refusal(request_, ALL)
    assert send_refusal(ReadCoils(1, 0, 16), ALL) == ""
    assert send_refusal(WriteCoils(1, 0, (0, 1, 0, 1)), ALL) == ""
    assert send_refusal(WriteCoil(1, 0, 1), ALL, read_only=True)


def test_place_decides_what_is_written() -> None:
    assert wire_place(3, 7) == 7, "a register is its own place"
    assert [at_place(wire_place(space, 65535)) for space in (1, 2, 3, 4)] == [
        (1, 65535), (2, 65535), (3, 65535), (4, 65535),
    ]  # fmt: skip
    both = frozenset({5, 6, 15, 16})
    assert write_request(1, 7, [1], None, both) == WriteOne(1, 7, 1)
    assert write_request(1, COIL + 7, [1], None, both) == WriteCoil(1, 7, 1)
    assert write_request(1, COIL + 7, [1, 0], None, both) == WriteCoils(1, 7, (1, 0))
    assert write_request(1, COIL + 7, [1], None, frozenset({15})) == WriteCoils(1, 7, (1,))
    assert write_request(1, 7, [1], True, both) == WriteMany(1, 7, (1,))
    with pytest.raises(RequestRefused, match="Function 5 writes one"):
        write_request(1, COIL, [1, 0], False, both)
    for function in (2, 4):
        assert send_refusal(write_request(1, wire_place(function, 7), [1], None, both), ALL)


@pytest.mark.parametrize(
    "request_",
    [ReadCoils(1, 5, 9), ReadDiscrete(1, 5, 9), WriteCoil(1, 7, 1), WriteCoils(1, 7, (0, 1))],
)
def test_other_programs_get_the_same_request(request_: Request) -> None:
    assert request_from(*request_form(request_)) == request_


def test_requests_in_messages_are_bounded() -> None:
    kind, fields = request_form(WriteCoil(1, 7, 1))
    with pytest.raises(ValueError, match="does not fit"):
        request_from(kind, {**fields, "value": 2})


def test_probe_stays_in_the_space_of_its_request() -> None:
    assert single_read(WriteCoil(1, 7, 1)) == ReadCoils(1, 7, 1)
    assert single_read(WriteCoils(1, 7, (1, 0))) == ReadCoils(1, 7, 1)
    assert single_read(ReadDiscrete(1, 7, 9)) == ReadDiscrete(1, 7, 1)
    assert single_read(WriteOne(1, 7, 1)) == Read(1, 7, 1)
    assert single_read(ReadInput(1, 7, 2)) == Read(1, 7, 1)
    assert [type(read_request(1, 0, 1, code)) for code in (1, 2, 3, 4)] == [
        ReadCoils, ReadDiscrete, Read, ReadInput,
    ]  # fmt: skip


def test_errors_name_coils() -> None:
    assert request_text(5, 7) == "function 5, coil 7"
    assert request_text(2, 7) == "function 2, input 7"
    assert request_text(6, 7) == "function 6, register 7"


# On a line


BITS_TOO = replace(
    WIDE, functions=WIDE.functions | {1, 2, 5, 15}, max_read_1=24, max_read_2=24, max_write_15=8
)
OTHER_FUNCTION = {1: 2, 2: 1, 5: 6, 15: 16}


def with_other_function(request: bytes, _count: int) -> list[bytes | float]:
    """Reply as a drive would that was asked by another function for as many bytes."""
    pdu = honest_pdu(request[1:-2])
    return [frame(request[0], bytes([OTHER_FUNCTION[pdu[0]]]) + pdu[1:])]


@pytest.mark.parametrize("function", [1, 2])
async def test_line_takes_no_reply_of_another_function(function: int, open_line: OpenLine) -> None:
    with PtyPeer(with_other_function) as peer:
        line = open_line(peer.path, BRISK)
        line.describe(1, BITS_TOO)
        with pytest.raises(WrongReply, match="function"):
            await line.read(1, 8, 3, function=function, priority=Priority.BACKGROUND)


@pytest.mark.parametrize("values", [[1], [1, 0]])
async def test_line_takes_no_acknowledgement_of_a_register_for_a_coil(
    values: list[int], open_line: OpenLine
) -> None:
    with PtyPeer(with_other_function) as peer:
        line = open_line(peer.path, BRISK)
        line.describe(1, BITS_TOO)
        with pytest.raises(WrongReply, match="function"):
            await line.write(1, COIL + 8, values)
        assert len([sent for sent in peer.requested(1) if sent[1] in (5, 15)]) == 1, "sent once"


@pytest.mark.parametrize("echo", [True, False])
async def test_coils_are_read_and_written_with_and_without_an_echo(
    echo: bool, open_line: OpenLine
) -> None:
    with PtyPeer(honest, echo=echo) as peer:
        line = open_line(peer.path, BRISK)
        line.describe(1, BITS_TOO)
        await line.write(1, COIL + 5, [1])
        await line.write(1, COIL + 5, [1, 0])
        assert (await line.read(1, 6, 4, function=1)).words == (0, 0, 1, 1)
        # its reply begins like the request: 24 coils from 03xx on
        assert (await line.read(1, 0x0300, 24, function=1)).words == (0,) * 8 + (1,) * 8 + (0,) * 8
        assert (await line.read(1, 15, 2, function=2)).words == (1, 0)


async def test_echo_of_a_coil_is_no_acknowledgement(open_line: OpenLine) -> None:
    with PtyPeer(silent, echo=True) as peer:
        line = open_line(peer.path, BRISK)
        line.describe(1, BITS_TOO)
        with pytest.raises(NoAnswer):
            await line.write(1, COIL + 5, [0])


async def test_late_reply_is_not_taken_for_other_inputs(open_line: OpenLine) -> None:
    def late_once(request: bytes, count: int) -> list[bytes | float]:
        return [0.3, reply(request)] if count == 0 else [reply(request)]

    with PtyPeer(late_once) as peer:
        line = open_line(peer.path, BRISK)
        line.describe(1, BITS_TOO)
        with pytest.raises(NoAnswer):
            await line.read(1, 0, 3, function=2, priority=Priority.OPERATOR_WRITE)
        found = await line.read(1, 8, 3, function=2, priority=Priority.OPERATOR_WRITE)
        assert found.words == (1, 1, 1)
