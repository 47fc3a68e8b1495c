"""One RTU line without a port: silences, the time of a reply, and what comes when none is due."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest

from tui.bus.errors import LineLost
from tui.bus.link import Link, RtuTcpLink, SerialLink, character_time, silence
from tui.bus.master import ExchangeResult, LineContext, Piece, ResultKind, Sending
from tui.bus.model import Timing
from tui.bus.requests import Read, Request, WriteOne
from tui.bus.rtu.master import PutOffTimer, RtuMaster
from tui.bus.tally import Tally
from tui.bus.trace import Trace
from tui.wire.frames import frame

from .peer import honest_pdu

READ = Read(1, 100, 1)
REPLY = frame(1, honest_pdu(READ.pdu()))
LINK = SerialLink("/dev/null", baud=9600)
CHARACTER, GAP = character_time(LINK), silence(LINK)


class Wire:
    """A master whose transport has the time of the test; `replies` follow what is sent."""

    def __init__(self, *replies: tuple[float, bytes], link: Link = LINK, **more: Any) -> None:
        self.now = 1000.0
        self.replies = list(replies)
        self.sent: list[tuple[float, bytes]] = []
        self.strays: list[tuple[Piece, float]] = []
        self.ended = 0
        self.rests: list[float] = []
        self.late: list[bytes] = []
        self.timing, self.tally, self.trace = Timing(), Tally(), Trace(100)
        around = LineContext(
            self.timing, self.trace, self.tally, lambda: self.now,
            lambda piece, time: self.strays.append((piece, time)),
        )  # fmt: skip
        self.master = RtuMaster(
            cast(Any, self), link, around, self._end, **{"wire_time": False, **more}
        )

    def _end(self) -> None:
        self.ended += 1

    def start(self, master: RtuMaster) -> None:
        """Nothing is read here."""

    def close(self) -> None:
        self.ended += 100

    async def take_in(self) -> None:
        if self.late:
            self.master.received(self.late.pop(), self.now)

    async def rest(self, until: float) -> None:
        self.rests.append(until)
        self.now = max(self.now, until)

    async def send(self, data: bytes) -> None:
        self.sent.append((self.now, data))
        loop = asyncio.get_running_loop()
        for after, piece in self.replies:
            loop.call_soon(self._receive, after, piece)

    def _receive(self, after: float, piece: bytes) -> None:
        self.now += after
        self.master.received(piece, self.now)

    async def exchange(self, request: Request = READ, time_out: float = 5.0) -> ExchangeResult:
        sending = Sending(request.device, request.pdu(), request.expectation(), time_out)
        return await self.master.exchange(sending)


async def test_request_is_sent_after_the_silence_and_its_reply_has_its_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wire = Wire((0.125, REPLY))
    ends: list[tuple[Any, ...]] = []
    monkeypatch.setattr(Tally, "count_end", lambda _, *those: ends.append(those))
    result = await wire.exchange()
    assert ends == [(1, pytest.approx(0.125), len(REPLY))]
    ((begun, data),) = wire.sent
    assert begun == pytest.approx(1000.0 + GAP)
    assert data == frame(1, READ.pdu())
    assert (result.kind, result.pdu) == (ResultKind.REPLY, REPLY[1:-2])
    assert result.sent == pytest.approx(begun + len(data) * CHARACTER)
    assert result.end == pytest.approx(begun + 0.125)
    left = 0.125 - (len(data) + len(REPLY)) * CHARACTER
    assert result.turnaround == pytest.approx(left)
    assert [(entry.direction, entry.data) for entry in wire.trace.frames()] == [
        ("out", data),
        ("in", REPLY),
    ]
    assert wire.tally.bytes_in == len(REPLY)
    again = await wire.exchange()
    assert again.kind is ResultKind.REPLY
    assert wire.sent[1][0] == pytest.approx(result.end + GAP)


async def test_reply_in_pieces_is_awaited_to_its_end() -> None:
    pauses: list[float] = []
    wire = Wire((0.1, REPLY[:2]), (0.001, REPLY[2:]))
    wire.master.pause = pauses.append
    result = await wire.exchange()
    assert (result.kind, result.pdu) == (ResultKind.REPLY, REPLY[1:-2])
    assert pauses == [pytest.approx((len(REPLY) - 2) * CHARACTER - 0.0003)]


async def test_pieces_beside_the_reply_are_traced_with_their_remarks() -> None:
    other = frame(2, honest_pdu(READ.pdu()))
    wire = Wire((0.1, frame(1, READ.pdu()) + other + REPLY))
    assert (await wire.exchange()).pdu == REPLY[1:-2]
    assert [(entry.direction, entry.data, entry.note) for entry in wire.trace.frames()[1:]] == [
        ("in", frame(1, READ.pdu()), "echo"), ("in", other, "of device 2"), ("in", REPLY, ""),
    ]  # fmt: skip


async def test_request_without_a_reply_ends_with_its_time() -> None:
    wire = Wire()
    result = await wire.exchange(time_out=-1.0)
    assert result.kind is ResultKind.NOTHING
    assert result.end == wire.now


async def test_broadcast_is_followed_by_its_own_pause() -> None:
    wire = Wire()
    write = WriteOne(0, 8501, 0)
    wire.timing = Timing()
    work = asyncio.create_task(wire.master.exchange(Sending(0, write.pdu(), None, 0.0)))
    while not wire.sent:  # noqa: ASYNC110 - its own loop sends it
        await asyncio.sleep(0)
    sent = wire.master._sent
    wire.now = sent + wire.timing.turnaround_delay + 0.001
    assert (await work).kind is ResultKind.NOTHING
    assert wire.master._hold == pytest.approx(sent + wire.timing.turnaround_delay)


async def test_line_that_never_falls_silent_is_used_after_a_second() -> None:
    wire = Wire((0.0, REPLY))

    async def babbles(until: float) -> None:
        wire.now += 0.002
        wire.master._last = wire.now

    cast(Any, wire).rest = babbles
    await wire.master.quiet()
    assert wire.now == pytest.approx(1001.0, abs=0.01)


async def test_byte_in_the_last_moment_prolongs_the_silence() -> None:
    wire = Wire((0.05, REPLY))
    wire.late = [b"x"]
    await wire.exchange()
    assert wire.sent[0][0] == pytest.approx(1000.0 + 2 * GAP)


async def test_frames_while_no_reply_is_due_are_strays_and_the_rest_noise() -> None:
    wire = Wire()
    other = frame(7, bytes([3, 2, 0, 9]))
    wire.master.received(other, 1000.5)
    wire.master.received(b"no", 1000.6)
    wire.master._sort_idle()
    assert [(piece.data, time) for piece, time in wire.strays] == [(other, 1000.6)]
    assert [entry.note for entry in wire.trace.frames()] == ["late or repeated, device 7", "noise"]
    assert wire.tally.stale == 1
    wire.master._sort_idle()
    assert len(wire.trace.frames()) == 2
    for _ in range(3):
        wire.master.received(bytes(100), 1001.0)
    assert len(wire.trace.frames()) > 2, "256 bytes without a pause are decoded"
    wire.master.close()


async def test_lost_port_ends_the_exchange_and_every_later_one() -> None:
    wire = Wire()
    work = asyncio.create_task(wire.exchange())
    while not wire.sent:  # noqa: ASYNC110 - its own loop sends it
        await asyncio.sleep(0)
    wire.master.lost("unplugged")
    with pytest.raises(LineLost, match=r"^The line was lost: unplugged\.$"):
        await work
    assert wire.ended == 1
    with pytest.raises(LineLost):
        await wire.exchange()
    with pytest.raises(LineLost):
        await wire.master.quiet()
    assert len(wire.sent) == 1


async def test_port_that_fails_in_sending_is_lost_with_its_reason() -> None:
    wire = Wire()

    async def fails(_: bytes) -> None:
        raise OSError(5, "Input/output error")

    cast(Any, wire).send = fails
    with pytest.raises(LineLost, match=r"^The line was lost: Input/output error\.$"):
        await wire.exchange()
    assert wire.ended == 101, "closed, and reported once"


async def test_finished_stop_is_sent_after_a_gap_and_keeps_the_line_quiet() -> None:
    wire = Wire()
    data = frame(1, WriteOne(1, 8501, 0).pdu())
    await wire.master.send_finished(data)
    assert [item for _, item in wire.sent] == [data]
    on_wire = len(data) * CHARACTER
    assert wire.master._hold == pytest.approx(wire.now + on_wire + wire.timing.turnaround_delay)


def replies(*early: bool) -> RtuMaster:
    """A master on a line with a baud, after replies that began early or not."""
    wire = Wire(wire_time=True)
    wire.master._early.extend(early)
    wire.master._sent = 1000.0
    return wire.master


@pytest.mark.parametrize(
    ("before", "begins", "kind", "early"),
    [
        ([False] * 7, -0.0011, ResultKind.REPLY, True),
        ([False] * 7, -0.0011, ResultKind.EXCEPTION, True),
        ([False] * 7, -0.0009, ResultKind.REPLY, False),
        ([False] * 7, -0.0011, ResultKind.DAMAGED, False),
        ([False] * 6, -0.0011, ResultKind.REPLY, False),
        ([False] * 17 + [True] * 2, -0.0011, ResultKind.REPLY, True),  # 3 of 20: 15 %
        ([False] * 16 + [True] * 2, -0.0011, ResultKind.REPLY, False),
    ],
)
async def test_reply_that_began_before_the_end_of_its_request_belongs_to_another(
    before: list[bool], begins: float, kind: ResultKind, early: bool
) -> None:
    master = replies(*before)
    pdu = bytes([3, 2, 0, 7])
    time = 1000.0 + begins + (len(pdu) + 3) * CHARACTER
    assert master._came_too_early(ExchangeResult(kind, pdu), time) == early
    counted = kind is not ResultKind.DAMAGED
    assert len(master._early) == len(before) + counted
    master._wire_time = False
    assert not master._came_too_early(ExchangeResult(kind, pdu), time)


async def test_reply_may_begin_before_the_end_of_its_request_by_the_tolerance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tui.bus.rtu.master.TOLERANCE", 0.125)
    for begins, early in ((0.125, False), (0.1875, True)):
        master = replies(*[False] * 50)
        master._character = 0.0
        result = ExchangeResult(ResultKind.REPLY, bytes([3, 2, 0, 7]))
        assert master._came_too_early(result, master._sent - begins) is early


def test_gap_over_tcp_is_longer_than_on_a_port() -> None:
    tcp = RtuTcpLink("127.0.0.1", 1)
    timing = Timing()
    for link, floor in ((tcp, timing.frame_gap_tcp), (LINK, timing.frame_gap)):
        assert Wire(link=link).master._gap == max(silence(link), floor)


async def test_timer_that_is_put_off_rings_once_at_its_last_time() -> None:
    timer, rung = PutOffTimer(), []
    begun = asyncio.get_running_loop().time()

    def ring() -> None:
        rung.append(asyncio.get_running_loop().time() - begun)

    timer.start(0.01, ring)
    timer.start(0.03, ring)
    await asyncio.sleep(0.05)
    assert len(rung) == 1
    assert rung[0] >= 0.029
    timer.start(0.005, ring)
    timer.leave()
    await asyncio.sleep(0.02)
    timer.start(0.005, ring)
    timer.stop()
    await asyncio.sleep(0.02)
    assert len(rung) == 1
    timer.start(10.0, ring)
    timer.start(0.005, ring)
    await asyncio.sleep(0.05)
    assert len(rung) == 2, "a shorter delay does not wait for the longer one"


async def test_time_of_an_exchange_that_has_ended_is_not_looked_at() -> None:
    wire = Wire((0.125, REPLY))
    wire.master._look_at_time()
    await wire.exchange()
    wire.master._look_at_time()
    assert wire.master._exchange is None
