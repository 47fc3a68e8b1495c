"""Frames inside received bytes, and the verdicts on them; no port, no clock."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.bus.master import ExchangeResult, Piece, ResultKind
from tui.bus.requests import Identify, Read, Request, WriteOne
from tui.bus.rtu.exchange import RtuExchange, find_reply, noted, pieces
from tui.wire.frames import frame, is_whole

from .peer import honest_pdu

READ = Read(1, 5, 2)
REPLY = frame(1, honest_pdu(READ.pdu()))
OTHER = frame(7, bytes([3, 2, 0, 9]))


def exchange_of(request: Request, **more: bool | int | None) -> RtuExchange:
    data = frame(request.device, request.pdu())
    return RtuExchange(data, request.expectation(), **more)  # type: ignore[arg-type]


@given(noise=st.binary(max_size=12), tail=st.binary(max_size=12))
def test_reply_is_found_among_any_bytes(noise: bytes, tail: bytes) -> None:
    match = find_reply(noise + REPLY + tail, 1, READ.expectation())
    assert match is not None
    assert is_whole((noise + REPLY + tail)[match.start : match.end])


@given(cut=st.integers(0, len(REPLY) - 1), bit=st.integers(0, 8 * len(REPLY) - 1))
def test_cut_or_damaged_reply_is_not_found(cut: int, bit: int) -> None:
    assert find_reply(REPLY[:cut], 1, READ.expectation()) is None
    damaged = bytearray(REPLY)
    damaged[bit // 8] ^= 1 << bit % 8
    assert find_reply(damaged, 1, READ.expectation()) is None


def test_reply_of_another_device_is_not_found() -> None:
    """The same to the last word, and its checksum is right."""
    theirs = frame(7, honest_pdu(READ.pdu()))
    assert find_reply(theirs, 1, READ.expectation()) is None
    match = find_reply(theirs + REPLY, 1, READ.expectation())
    assert match is not None
    assert match.start == len(theirs)
    assert exchange_of(READ).feed(theirs) is None


def test_identification_is_found_by_its_object_lengths() -> None:
    request = Identify(1)
    whole = frame(1, honest_pdu(request.pdu()))
    for length in range(len(whole)):
        assert find_reply(whole[:length], 1, request.expectation()) is None
    assert find_reply(b"\x01\x2b" + whole, 1, request.expectation()) is not None


@pytest.mark.parametrize("pdu", [bytes([0xAB, 1]), bytes([0xAB, 14, 1])])
def test_refusals_of_identification_are_found(pdu: bytes) -> None:
    match = find_reply(b"\0" + frame(1, pdu), 1, Identify(1).expectation())
    assert match is not None
    assert match.exception == 1
    assert find_reply(frame(1, pdu), 1, Identify(1).expectation(), exceptions=False) is None


def test_pieces_separates_whole_frames_from_noise() -> None:
    assert pieces(b"\x33" + OTHER + b"\x44\x55" + REPLY) == [
        Piece(b"\x33", whole=False),
        Piece(OTHER, whole=True),
        Piece(b"\x44\x55", whole=False),
        Piece(REPLY, whole=True),
    ]
    assert pieces(b"") == []
    assert Piece(OTHER, whole=True).device == 7


@given(st.binary(max_size=300))
def test_pieces_lose_no_byte(data: bytes) -> None:
    assert b"".join(piece.data for piece in pieces(data)) == data


@given(st.lists(st.integers(1, 5), max_size=20))
def test_reply_that_arrives_in_pieces_is_found(sizes: list[int]) -> None:
    exchange, rest, verdict = exchange_of(READ), OTHER + REPLY, None
    for size in [*sizes, len(rest)]:
        lump, rest = rest[:size], rest[size:]
        verdict = verdict or exchange.feed(lump)
    assert verdict is not None
    assert verdict.kind is ResultKind.REPLY
    assert verdict.resynchronised


def test_skipped_replies_are_not_accepted() -> None:
    exchange = exchange_of(READ, skip=1)
    assert exchange.feed(REPLY) is None
    verdict = exchange.feed(REPLY)
    assert verdict is not None
    assert verdict.kind is ResultKind.REPLY


WRITE = WriteOne(1, 5, 7)
COPY = frame(1, WRITE.pdu())


@pytest.mark.parametrize(
    ("echo", "received", "kind"),
    [
        (False, b"", ResultKind.NOTHING),
        (False, COPY, ResultKind.REPLY),
        (True, COPY, ResultKind.NOTHING),
        (True, COPY * 2, ResultKind.REPLY),
        (None, b"", ResultKind.NOTHING),
        (None, COPY, ResultKind.UNSURE),
        (None, COPY * 2, ResultKind.REPLY),
        (True, COPY + frame(1, bytes([0x86, 3])), ResultKind.EXCEPTION),
        (None, COPY + frame(1, bytes([0x86, 3])), ResultKind.EXCEPTION),
    ],
)
def test_write_reply_depends_on_the_echo_of_the_adapter(
    echo: bool | None, received: bytes, kind: ResultKind
) -> None:
    exchange = exchange_of(WRITE, echo=echo)
    verdict = exchange.feed(received) or exchange.expired()
    assert verdict.kind is kind


@pytest.mark.parametrize(
    ("received", "echo"),
    [
        (REPLY, False),
        (frame(1, READ.pdu()) + REPLY, True),
        (b"\x55" + REPLY, None),
        (frame(1, READ.pdu()), True),
        (b"", False),
        (b"\x55", None),
    ],
)
def test_echo_is_learned_from_reads(received: bytes, echo: bool | None) -> None:
    exchange = exchange_of(READ)
    if exchange.feed(received) is None:
        exchange.expired()
    assert exchange.echo is echo


@pytest.mark.parametrize(
    ("received", "ends"),
    [
        (b"\x55", False),
        (b"\x55\x66\x77\x88\x99", False),
        (OTHER, False),
        (frame(1, READ.pdu())[:4], False),
        (frame(1, READ.pdu()), False),
        (REPLY[:4], True),
        (REPLY[1:], True),
        (b"\x55" + REPLY[1:], True),
        (OTHER + REPLY[:3], True),
        (b"\x01\x83\x02", True),
    ],
)
def test_gap_ends_the_wait_for_a_partial_reply_only(received: bytes, ends: bool) -> None:
    exchange = exchange_of(READ)
    assert exchange.feed(received) is None
    verdict = exchange.silent()
    assert (verdict is not None) is ends
    if verdict is not None:
        assert verdict.kind is ResultKind.DAMAGED


@pytest.mark.parametrize(
    ("received", "kind"),
    [
        (b"", ResultKind.NOTHING),
        (b"\x55", ResultKind.NOTHING),
        (OTHER, ResultKind.NOTHING),
        (b"\x55\x66\x77\x88", ResultKind.DAMAGED),
        (frame(1, bytes([4, 2, 0, 9])), ResultKind.WRONG),
    ],
)
def test_result_at_the_timeout_depends_on_the_bytes_received(
    received: bytes, kind: ResultKind
) -> None:
    exchange = exchange_of(READ)
    exchange.feed(received)
    assert exchange.expired().kind is kind


def test_whole_frames_around_a_reply_are_strays_but_noise_is_not() -> None:
    exchange = exchange_of(READ)
    result = exchange.feed(b"\x33" + OTHER + b"\x44\x55" + REPLY)
    assert result is not None
    assert result.strays == [Piece(OTHER, whole=True)]
    assert result.resynchronised
    assert result.received == b"\x33" + OTHER + b"\x44\x55" + REPLY
    alone = exchange_of(READ).feed(REPLY)
    assert alone is not None
    assert (alone.strays, alone.resynchronised) == ([], False)


SENT = frame(1, READ.pdu())
RIGHT = honest_pdu(READ.pdu())
REFUSED = bytes([0x83, 2])


@pytest.mark.parametrize(
    ("kind", "pdu", "received", "remarks"),
    [
        (ResultKind.NOTHING, b"", [], []),
        (ResultKind.REPLY, RIGHT, [REPLY], [""]),
        (ResultKind.EXCEPTION, REFUSED, [frame(1, REFUSED)], [""]),
        (ResultKind.REPLY, RIGHT, [SENT, REPLY], ["echo", ""]),
        (ResultKind.REPLY, RIGHT, [b"\x33", OTHER, REPLY], ["noise", "of device 7", ""]),
        (ResultKind.REPLY, RIGHT, [REPLY, b"\x33"], ["", "noise"]),
        (ResultKind.REPLY, RIGHT, [frame(1, REFUSED), REPLY], ["not the reply", ""]),
        (ResultKind.UNSURE, b"", [SENT], ["echo or answer"]),
        (ResultKind.NOTHING, b"", [SENT], ["echo"]),
        (ResultKind.NOTHING, b"", [b"\x55"], ["noise"]),
        (ResultKind.DAMAGED, b"", [REPLY[:4]], ["damaged"]),
        (ResultKind.WRONG, b"", [frame(1, REFUSED)], ["not the reply"]),
    ],
)
def test_each_received_piece_has_its_remark_in_the_trace(
    kind: ResultKind, pdu: bytes, received: list[bytes], remarks: list[str]
) -> None:
    result = ExchangeResult(kind, pdu=pdu, received=b"".join(received))
    assert list(noted(result, SENT, 1)) == list(zip(received, remarks, strict=True))


def test_reply_that_is_like_its_request_has_no_remark_of_an_echo() -> None:
    """The reply to a write repeats it; the adapter's echo before it is remarked."""
    write = WriteOne(1, 5, 7)
    data = frame(1, write.pdu())
    result = ExchangeResult(ResultKind.REPLY, pdu=write.pdu(), received=data + data)
    assert [note for _, note in noted(result, data, 1)] == ["", ""]


@pytest.mark.parametrize(
    ("request_", "characters"), [(READ, 9), (Read(1, 5, 125), 255), (WriteOne(1, 5, 7), 8)]
)
def test_longest_reply_is_that_of_the_request_after_an_echo(
    request_: Request, characters: int
) -> None:
    echo = len(frame(1, request_.pdu()))
    assert exchange_of(request_).longest == characters
    assert exchange_of(request_, echo=False).longest == characters
    assert exchange_of(request_, echo=True).longest == echo + characters
    assert exchange_of(Identify(1)).longest == 256


@pytest.mark.parametrize("words", [1, 2, 60])
@pytest.mark.parametrize("echo", [True, False])
def test_reply_that_has_begun_is_awaited_to_its_end(words: int, echo: bool) -> None:
    """As long as it may be a refusal, only to the end of that."""
    request = Read(1, 5, words)
    reply = frame(1, honest_pdu(request.pdu()))
    for count in range(len(reply)):
        exchange = exchange_of(request, echo=echo)
        exchange.feed((frame(1, request.pdu()) if echo else b"") + reply[:count])
        is_certain = count >= 3 or (words == 1 and count)
        due = len(reply) - count if is_certain else 5 - count if count else 0
        assert exchange.missing == due, count


@pytest.mark.parametrize(
    "received", [b"\x02", b"\x01\x04", b"\x01\x83", OTHER[:4], b"\x01\x03\x05"]
)
def test_nothing_is_missing_of_bytes_that_begin_no_reply(received: bytes) -> None:
    exchange = exchange_of(READ, echo=False)
    exchange.feed(received)
    assert exchange.missing == 0


def test_nothing_is_missing_while_an_earlier_reply_is_skipped() -> None:
    exchange = exchange_of(READ, echo=False, skip=1)
    exchange.feed(REPLY[:4])
    assert exchange.missing == 0


@pytest.mark.parametrize("skip", [0, 1, 2])
def test_earlier_replies_are_skipped_one_by_one(skip: int) -> None:
    exchange = exchange_of(READ, skip=skip)
    for _ in range(skip):
        assert exchange.feed(REPLY) is None
    result = exchange.feed(REPLY)
    assert result is not None
    assert (result.kind, result.pdu) == (ResultKind.REPLY, RIGHT)


@pytest.mark.parametrize("exceptions", [True, False])
def test_refusal_is_not_skipped_and_counts_only_if_it_is_the_own(exceptions: bool) -> None:
    result = exchange_of(READ, skip=1, exceptions=exceptions).feed(frame(1, REFUSED))
    assert (result is not None) is exceptions
    if result is not None:
        assert (result.kind, result.exception, result.pdu) == (ResultKind.EXCEPTION, 2, REFUSED)


def test_reply_of_an_earlier_request_is_passed_over() -> None:
    exchange = exchange_of(READ, echo=False)
    first, second = (frame(1, bytes([3, 4, 0, number, 0, 0])) for number in (1, 2))
    result = exchange.feed(first)
    assert result is not None
    assert exchange.pass_over(result) is None
    following = exchange.feed(second)
    assert following is not None
    assert following.pdu == second[1:-2]


def test_reply_after_a_flood_of_noise_is_found_in_bounded_memory() -> None:
    exchange = exchange_of(READ)
    for _ in range(100):
        assert exchange.feed(b"\x55" * 199) is None
        assert len(exchange.buffer) <= 4096
    result = exchange.feed(REPLY)
    assert result is not None
    assert result.pdu == RIGHT


def test_broadcast_has_no_reply() -> None:
    exchange = RtuExchange(frame(0, WriteOne(0, 5, 7).pdu()), None)
    assert not exchange.expected
    assert exchange.feed(REPLY) is exchange.silent() is None
    assert exchange_of(READ).expected


@pytest.mark.parametrize(
    ("received", "known"),
    [([SENT, REPLY], True), ([REPLY], False), ([b"\x33", REPLY], None)],
)
def test_exchange_shows_if_the_adapter_echoes(received: list[bytes], known: bool | None) -> None:
    exchange = exchange_of(READ)
    assert exchange.feed(b"".join(received)) is not None
    assert exchange.echo is known
