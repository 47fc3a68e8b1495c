"""Parts of an RTU master: each received piece, each wait, and each way in which a request ends."""

from __future__ import annotations

import asyncio
from typing import Any
from unittest.mock import AsyncMock, Mock, call

import pytest

from tui.bus.errors import LineLost
from tui.bus.master import ExchangeResult, ResultKind, Sending
from tui.bus.requests import Identify, Read, WriteOne
from tui.bus.rtu.master import BABBLE, BEFORE_END, IDLE_LIMIT, LEAD, MUCH_TALK
from tui.safety import FROZEN_IN_SENDING
from tui.wire.frames import MAX_FRAME, frame

from .peer import honest_pdu
from .test_rtu_master import CHARACTER, GAP, Wire

NOW = 1000.0
READ = Read(1, 100, 1)
DATA = frame(1, READ.pdu())
REPLY = frame(1, honest_pdu(READ.pdu()))
SENDING = Sending(1, READ.pdu(), READ.expectation(), 0.5)


class Rig(Wire):
    """A master whose timers note their calls."""

    def __init__(self, **more: Any) -> None:
        super().__init__(**more)
        self.it: Any = self.master
        self.it._timer, self.it._time_out = Mock(), Mock()
        self.it.pause = Mock()
        self.done: Any = Mock(done=lambda: False)

    def begin(self, **more: Any) -> Any:
        """An exchange in progress."""
        plain = {"buffer": b"", "longest": 20, "missing": 0, "expected": True}
        self.it._exchange = Mock(**{**plain, **more})
        self.it._exchange.feed.return_value = None
        self.it._exchange.silent.return_value = None
        self.it._done = self.done
        return self.it._exchange

    @property
    def settled(self) -> list[Any]:
        return [each.args[0] for each in self.done.set_result.call_args_list]


# -- received bytes --------------------------------------------------------------------------------


def test_bytes_while_no_reply_is_due_are_decoded_after_a_silence_or_if_they_are_many() -> None:
    rig = Rig()
    rig.it.received(b"\x55" * (MUCH_TALK - 1), NOW + 1)
    rig.it._timer.start.assert_called_once_with(rig.it._gap, rig.it._sort_idle)
    assert (rig.it._last, rig.tally.bytes_in, len(rig.trace.frames())) == (
        NOW + 1, MUCH_TALK - 1, 0,
    )  # fmt: skip
    rig.it.received(b"\x55", NOW + 2)
    assert rig.it._timer.start.call_count == 1
    rig.it._timer.stop.assert_called_once_with()
    (noted,) = rig.trace.frames()
    assert (noted.time, noted.direction, noted.data, noted.note) == (
        NOW + 2, "in", b"\x55" * MUCH_TALK, "noise",
    )  # fmt: skip
    assert rig.it._idle == b""
    rig.it._sort_idle()
    assert rig.it._timer.stop.call_count == 1
    rig.it._sort_idle = Mock()
    rig.it.received(b"\x55" * (IDLE_LIMIT + 1), NOW + 3)
    assert len(rig.it._idle) == IDLE_LIMIT


@pytest.mark.parametrize("distrusts", [True, False])
def test_frame_while_no_reply_is_due_is_a_stray(distrusts: bool) -> None:
    rig = Rig()
    rig.it._distrusts = distrusts
    rig.it.received(REPLY, NOW + 1)
    rig.it._sort_idle()
    assert [(piece.data, time) for piece, time in rig.strays] == (
        [] if distrusts else [(REPLY, NOW + 1)]
    )
    assert rig.tally.stale == 1
    assert [each.note for each in rig.trace.frames()] == ["late or repeated, device 1"]


@pytest.mark.parametrize(
    ("missing", "pauses"), [(0, False), (1, False), (2, True)], ids=["none", "short", "long"]
)
def test_rest_of_a_reply_is_awaited_for_its_time_on_the_wire(missing: int, pauses: bool) -> None:
    rig = Rig()
    exchange = rig.begin(missing=missing)
    assert 0.0005 < CHARACTER - BEFORE_END < 0.001
    masters_pause = CHARACTER * missing - BEFORE_END
    rig.it._sent = NOW - 1
    rig.it._character = CHARACTER if missing != 1 else BEFORE_END + 0.0005
    rig.it.received(b"abc", NOW)
    exchange.feed.assert_called_once_with(b"abc")
    character = rig.it._character
    assert rig.it._over == NOW - 3 * character + 20 * character
    assert rig.it._ends == rig.it._over + rig.it._gap
    rig.it._timer.start.assert_called_once_with(rig.it._ends - NOW, rig.it._fell_silent)
    assert rig.it.pause.call_args_list == ([call(masters_pause)] if pauses else [])
    exchange.buffer = b"abc"
    rig.it.received(b"d", NOW + 9)
    assert rig.it._ends == NOW + 9 + rig.it._gap, "the first piece has set its end"
    rig.it._sent = NOW + 10
    rig.it.received(b"d", NOW + 9)
    assert rig.it._ends == NOW + 10 + rig.it._gap


def test_bytes_during_a_broadcast_end_nothing() -> None:
    rig = Rig()
    rig.begin(expected=False)
    rig.it.received(b"abc", NOW)
    rig.it._timer.start.assert_not_called()
    assert rig.settled == []


def test_reply_that_came_too_early_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig()
    exchange = rig.begin()
    early, right = ExchangeResult(ResultKind.REPLY), ExchangeResult(ResultKind.REPLY)
    exchange.feed.return_value, exchange.pass_over.return_value = early, right
    seen: list[float] = []

    def too_early(result: object, time: float) -> bool:
        seen.append(time)
        return result is early

    rig.it._came_too_early = too_early
    rig.it.received(b"abc", NOW)
    assert seen == [NOW, NOW]
    exchange.pass_over.assert_called_once_with(early)
    assert rig.settled[0] is right
    rig.it._timer.start.assert_not_called()


def test_silence_and_loss_end_the_exchange() -> None:
    rig = Rig()
    rig.it._fell_silent()
    exchange = rig.begin()
    rig.it._fell_silent()
    assert rig.settled == []
    exchange.silent.return_value = damaged = ExchangeResult(ResultKind.DAMAGED)
    rig.it._fell_silent()
    assert rig.settled == [damaged]
    rig.it.lost("unplugged")
    assert (str(rig.it.failure), rig.ended) == ("The line was lost: unplugged.", 1)
    assert rig.settled[1].kind is ResultKind.NOTHING
    rig.it._timer.stop.assert_called_once_with()
    rig.it.close()
    assert (rig.it._timer.stop.call_count, rig.it._time_out.stop.call_count) == (2, 1)
    assert rig.ended == 101


@pytest.mark.parametrize(
    ("buffer", "ends", "deadline", "latest", "left"),
    [
        (b"", 9.0, 1.0, 9.0, 1.0), (b"x", 2.0, 1.0, 9.0, 2.0), (b"x", 1.0, 2.0, 9.0, 2.0),
        (b"x", 9.0, 1.0, 3.0, 3.0), (b"x", -1.0, 0.0, 9.0, None), (b"x", 0.0, -1.0, 9.0, None),
        (b"x", 2.0, -1.0, 0.0, None), (b"", 5.0, 0.0, 9.0, None),
    ],
)  # fmt: skip
@pytest.mark.parametrize("falls_silent", [True, False])
def test_exchange_ends_with_its_time_or_a_lump_that_follows(
    buffer: bytes, ends: float, deadline: float, latest: float, left: float | None,
    falls_silent: bool,
) -> None:  # fmt: skip
    rig = Rig()
    exchange = rig.begin(buffer=buffer)
    silent, expired = ExchangeResult(ResultKind.DAMAGED), ExchangeResult(ResultKind.NOTHING)
    exchange.silent.return_value = silent if falls_silent else None
    exchange.expired.return_value = expired
    rig.it._ends, rig.it._deadline, rig.it._latest = NOW + ends, NOW + deadline, NOW + latest
    rig.it._look_at_time()
    if left is None:
        assert rig.settled == [silent if falls_silent and ends <= 0 else expired]
        rig.it._time_out.start.assert_not_called()
    else:
        assert rig.settled == []
        rig.it._time_out.start.assert_called_once_with(left, rig.it._look_at_time)


# -- waits -----------------------------------------------------------------------------------------


class Waits(Rig):
    """A master whose line falls silent as `rests` say: each is the time of a byte that came."""

    def __init__(self, *bytes_at: float) -> None:
        super().__init__()
        self.bytes_at = list(bytes_at)
        self.it._silence, self.it._last = 0.5, NOW

    async def rest(self, until: float) -> None:
        self.rests.append(until - NOW)
        assert len(self.rests) < 20
        self.now = until
        if self.bytes_at:
            self.it._last = self.bytes_at.pop(0)


async def test_next_request_is_prepared_just_before_the_end_of_the_silence() -> None:
    wait = Waits()
    wait.it._sort_idle = Mock()
    await wait.it.quiet()
    assert wait.rests == [pytest.approx(0.5 - LEAD)]
    wait.it._sort_idle.assert_called_once_with()
    await wait.it._silent(0.0)
    assert wait.now == NOW + 0.5
    wait = Waits(NOW + 0.25)
    await wait.it._silent(0.0)
    assert wait.rests == [0.5, 0.75]


async def test_line_is_held_for_a_broadcast_and_longer_than_babble() -> None:
    wait = Waits()
    wait.it._hold = NOW + 4
    await wait.it._silent(0.0)
    assert wait.now == NOW + 4
    wait = Waits(*(NOW + n / 4 for n in range(1, 20)))
    await wait.it._silent(0.0)
    assert wait.now == NOW + BABBLE
    wait = Waits(*(NOW + n / 4 for n in range(9, 40)))
    wait.it._hold = NOW + 2
    await wait.it._silent(0.0)
    assert wait.now == NOW + 2 + BABBLE


async def test_byte_that_is_still_in_the_port_prolongs_the_silence() -> None:
    wait = Waits()
    taken: list[float] = []

    async def take_in() -> None:
        taken.append(wait.now)
        if len(taken) == 1:
            wait.it._last = wait.now

    wait.take_in = take_in  # type: ignore[method-assign]
    await wait.it._silent(0.0)
    assert taken == [NOW + 0.5, NOW + 1.0]


async def test_lost_line_is_awaited_no_longer() -> None:
    wait = Waits()
    wait.it.failure = LineLost("unplugged")
    with pytest.raises(LineLost, match="unplugged"):
        await wait.it._silent(0.0)
    assert wait.rests == []


# -- requests --------------------------------------------------------------------------------------


def result_of(kind: ResultKind, pdu: bytes = b"", **more: Any) -> ExchangeResult:
    return ExchangeResult(kind, pdu=pdu, **more)


@pytest.mark.parametrize("kind", [ResultKind.REPLY, ResultKind.NOTHING, ResultKind.DAMAGED])
async def test_request_is_traced_and_counted_with_its_times(kind: ResultKind) -> None:
    rig = Rig()
    pdu = REPLY[1:-2] if kind is ResultKind.REPLY else b""
    result = result_of(kind, pdu, received=b"" if kind is ResultKind.NOTHING else REPLY)
    rig.it._count_port_errors = Mock()
    rig.it._sort_idle = Mock()
    rig.it._idle = bytearray(b"x")
    sent: list[object] = []

    async def settled(sending: Sending) -> ExchangeResult:
        exchange = rig.it._exchange
        sent.append((exchange.frame, exchange.echo, exchange._exceptions, exchange._skip))
        assert rig.it._sent == rig.it._last == NOW + len(DATA) * CHARACTER
        assert rig.it._done is not None
        rig.now += 2.0
        rig.it._last = NOW + 1.5
        exchange.echo = True
        return result

    rig.it._silent = AsyncMock()
    rig.it._result = settled
    look = Mock()
    sending = Sending(1, READ.pdu(), READ.expectation(), 0.5, False, 2, look)
    assert await rig.it.exchange(sending) is result
    look.assert_called_once_with()
    rig.it._silent.assert_awaited_once_with(0.0)
    rig.it._sort_idle.assert_called_once_with()
    assert sent == [(DATA, None, False, 2)]
    assert (rig.it._exchange, rig.it._done, rig.it.echo) == (None, None, True)
    rig.it._timer.stop.assert_called_once_with()
    rig.it._time_out.leave.assert_called_once_with()
    end = NOW + (2.0 if kind is ResultKind.NOTHING else 1.5)
    assert (result.sent, result.end) == (NOW + len(DATA) * CHARACTER, end)
    reply = (len(pdu) + 3) * CHARACTER
    assert result.turnaround == pytest.approx(end - result.sent - reply)
    device = rig.tally.of(1)
    assert (device.requests, device.bytes_out, device.bytes_in) == (
        1, len(DATA), len(result.received),
    )  # fmt: skip
    assert (device.busy_seconds, rig.tally.resyncs) == (2.0, 0)
    assert rig.it._count_port_errors.called == (kind is not ResultKind.REPLY)
    frames = rig.trace.frames()
    assert [(each.time, each.direction, each.data) for each in frames] == [
        (NOW, "out", DATA), *([(end, "in", REPLY)] if result.received else []),
    ]  # fmt: skip


async def test_reply_among_other_bytes_counts_as_such_and_its_time_is_not_negative() -> None:
    rig = Rig()
    rig.it._count_port_errors = Mock()
    rig.it._silent = AsyncMock()
    rig.it._result = AsyncMock(
        return_value=result_of(ResultKind.REPLY, REPLY[1:-2], resynchronised=True)
    )
    result = await rig.it.exchange(SENDING)
    assert (rig.tally.resyncs, result.turnaround) == (1, 0.0)
    rig.it._count_port_errors.assert_called_once_with()


@pytest.mark.parametrize(("took", "distrusts"), [(0.0, False), (1.0, True)])
async def test_reply_is_not_trusted_if_the_program_was_frozen_in_sending(
    took: float, distrusts: bool
) -> None:
    rig = Rig()

    async def send(data: bytes) -> None:
        rig.now += FROZEN_IN_SENDING * took * 2

    rig.it._send = send
    rig.it._silent = AsyncMock()
    for name in ("_result", "_distrust"):
        setattr(rig.it, name, AsyncMock(return_value=result_of(ResultKind.NOTHING)))
    await rig.it.exchange(SENDING)
    assert rig.it._distrust.await_count == distrusts
    assert rig.it._result.await_count == (not distrusts)


async def test_frozen_request_waits_for_the_end_of_its_time_and_ignores_replies() -> None:
    rig = Rig()
    rig.begin()
    rig.it._idle = bytearray(REPLY)
    seen: list[bool] = []
    sort = rig.it._sort_idle

    def sorted_then() -> None:
        seen.append(rig.it._distrusts)
        sort()

    rig.it._sort_idle = sorted_then
    result = await rig.it._distrust(SENDING)
    assert result.kind is ResultKind.NOTHING
    assert rig.now == pytest.approx(NOW + (len(READ.pdu()) + 3) * CHARACTER + 0.5)
    assert (seen, rig.strays, rig.it._distrusts, rig.it._exchange) == ([True], [], False, None)
    rig.it.failure = LineLost("unplugged")
    with pytest.raises(LineLost):
        await rig.it._distrust(SENDING)


@pytest.mark.parametrize(
    ("request_", "length"),
    [(READ, len(REPLY)), (Identify(1), MAX_FRAME), (WriteOne(0, 1, 1), None)],
)
async def test_result_is_awaited_for_the_timeout_and_a_reply_on_the_wire(
    request_: Any, length: int | None
) -> None:
    rig = Rig()
    rig.it._sent = NOW
    rig.it._done = asyncio.get_running_loop().create_future()
    rig.it._look_at_time = Mock(side_effect=lambda: rig.it._done.set_result("the result"))
    expectation = None if length is None else request_.expectation()
    sending = Sending(request_.device, request_.pdu(), expectation, 0.5)
    assert await rig.it._result(sending) == "the result"
    if length is None:
        pause = rig.timing.turnaround_delay
        assert rig.it._hold == rig.it._deadline == rig.it._latest == NOW + pause
    else:
        assert rig.it._deadline == NOW + 0.5
        assert rig.it._latest == NOW + 0.5 + length * CHARACTER + rig.it._gap
        assert rig.it._hold == 0.0
    rig.it._done = asyncio.get_running_loop().create_future()
    rig.it.failure = LineLost("unplugged")
    with pytest.raises(LineLost):
        await rig.it._result(sending)


@pytest.mark.parametrize("known", [True, False])
async def test_port_that_cannot_send_is_closed_and_lost(known: bool) -> None:
    rig = Rig()

    rig.it._transport = Mock(close=rig.close, send=AsyncMock(side_effect=OSError(5, "broken")))
    if known:
        rig.it.failure = LineLost("before")
    with pytest.raises(LineLost) as caught:
        await rig.it._send(DATA)
    text = "before" if known else "The line was lost: broken."
    assert (str(caught.value), rig.ended) == (text, 100 if known else 101)


async def test_finished_frame_is_sent_after_a_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, pauses = Rig(), AsyncMock()
    monkeypatch.setattr("tui.bus.rtu.master.asyncio.sleep", pauses)
    await rig.it.send_finished(DATA)
    pauses.assert_awaited_once_with(rig.it._gap)
    assert rig.it._gap >= GAP
