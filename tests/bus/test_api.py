"""Contract of a `ModbusLine`, for the line of live drives and for the fake."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

import pytest

from tests.line_events import on_event
from tui.bus.api import LineStatus, LineWorker, ModbusLine, Priority
from tui.bus.errors import (
    DeviceException,
    LineClosed,
    LineLost,
    NoAnswer,
    RequestRefused,
    Superseded,
)
from tui.bus.fake import FakeLine
from tui.bus.limits import CAUTIOUS, Limits
from tui.bus.line import Line, Timing
from tui.bus.line_events import StateChanged
from tui.bus.link import RtuTcpLink
from tui.bus.requests import Identify, Read, WriteOne
from tui.wire.frames import frame

from .conftest import PATIENT, WIDE
from .peer import Step, TcpPeer

HELD = {address: address for address in range(100, 110)}
THERE, SILENT = 1, 2
IDENTITY = {0: b"none"}


@dataclass
class End:
    """A line with one existing device, and the frames on the wire."""

    line: ModbusLine
    sent: Callable[[], list[bytes]]
    """The requests so far, from the function code on."""


def device(request: bytes, _count: int) -> Sequence[Step]:
    """A device that holds HELD; another says nothing."""
    if request[0] != THERE or (request[1] == 17 and held.get(17) == 0):
        return []
    return [frame(THERE, answer(request[1:-2]))]


def answer(pdu: bytes) -> bytes:
    address, count = int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
    if pdu[0] == 43:
        return bytes([43, 14, pdu[2], 1, 0, 0, 1, 0, 4]) + IDENTITY[0]
    if pdu[0] == 17:
        return bytes([17, 6, 9]) + IDENTITY[0] + b"\xff"
    if pdu[0] == 8:
        return pdu
    span = [address] if pdu[0] == 6 else range(address, address + count)
    if any(number not in held for number in span):
        return bytes([pdu[0] | 0x80, 2])
    if pdu[0] == 6:
        held[address] = count
    if pdu[0] in (16, 23):
        at, first = (6, address) if pdu[0] == 16 else (10, int.from_bytes(pdu[5:7], "big"))
        for offset in range(0, len(pdu) - at, 2):
            word = int.from_bytes(pdu[at + offset : at + offset + 2], "big")
            held[first + offset // 2] = word
    if pdu[0] in (3, 23):
        words = b"".join(held[number].to_bytes(2, "big") for number in span)
        return bytes([pdu[0], len(words)]) + words
    return pdu[:5]


held: dict[int, int] = {}

Open = Callable[..., End]


@pytest.fixture(params=["real", "fake"])
def end(request: pytest.FixtureRequest) -> Iterator[Open]:
    """Open a line of either kind; device 1 holds HELD, device 2 is silent."""
    held.clear()
    held.update(HELD)
    with ExitStack() as stack:

        def real(*, read_only: bool = False, timing: Timing = PATIENT) -> End:
            peer = stack.enter_context(TcpPeer(device))
            timing = replace(timing, probes=False)
            line = Line(RtuTcpLink("127.0.0.1", peer.port), read_only=read_only, timing=timing)
            stack.callback(line.close)
            line.open(wait=10.0)
            return described(End(line, lambda: [request[1:-2] for request in peer.requests]))

        def fake(*, read_only: bool = False, timing: Timing = PATIENT) -> End:
            line = FakeLine({THERE: HELD}, read_only=read_only)
            line.devices[THERE].identity = IDENTITY
            line.devices[THERE].called = IDENTITY[0]
            stack.callback(line.close)
            return described(End(line, lambda: [request.pdu() for request in line.requests]))

        yield real if request.param == "real" else fake


def described(end: End) -> End:
    for number in (THERE, SILENT):
        end.line.describe(number, WIDE)
    return end


async def test_read_returns_words_and_their_time(end: Open) -> None:
    made = end()
    reply = await made.line.read(THERE, 100, 3)
    assert reply.words == (100, 101, 102)
    assert made.line.device_state(THERE).heard == pytest.approx(reply.time, abs=1.0)
    assert made.sent() == [bytes.fromhex("03 0064 0003")]


async def test_write_is_read_back(end: Open) -> None:
    made = end()
    before = (await made.line.read(THERE, 101)).time
    assert await made.line.write(THERE, 101, [7]) >= before
    await made.line.write(THERE, 103, [8, 9])
    await made.line.write(THERE, 105, [10], multiple=True)
    reply = await made.line.read_write(THERE, 101, 5, 102, [11])
    assert reply.words == (7, 11, 8, 9, 10)
    assert [pdu[0] for pdu in made.sent()] == [3, 6, 16, 16, 23]


async def test_exception_has_its_code_and_meaning(end: Open) -> None:
    made = end()
    with pytest.raises(DeviceException, match="the device has no such address") as read:
        await made.line.read(THERE, 108, 4)
    with pytest.raises(DeviceException) as write:
        await made.line.write(THERE, 300, [1])
    found = [
        (e.value.device, e.value.function, e.value.address, e.value.code) for e in (read, write)
    ]
    assert found == [(THERE, 3, 108, 2), (THERE, 6, 300, 2)]
    assert made.line.device_state(THERE).answers


BRISK = Timing(first_timeout=0.2, min_timeout=0.2, late_reply=0.3, retries=0)


async def test_unanswered_write_is_reported_and_sent_once(end: Open) -> None:
    made = end(timing=BRISK)
    with pytest.raises(NoAnswer) as raised:
        await made.line.write(SILENT, 100, [5])
    assert (raised.value.device, raised.value.function, raised.value.address) == (SILENT, 6, 100)
    assert made.sent() == [bytes.fromhex("06 0064 0005")]
    state = made.line.device_state(SILENT)
    assert (state.answers, state.failures, state.heard) == (False, 1, None)
    assert state.silent_since is not None


async def test_read_only_line_sends_no_request_that_changes_a_device(end: Open) -> None:
    made = end(read_only=True)
    assert made.line.read_only
    for write in (
        made.line.write(THERE, 100, [5]),
        made.line.read_write(THERE, 100, 1, 100, [5]),
        made.line.broadcast(100, [5], limits=WIDE),
        made.line.diagnose(THERE, 10),
    ):
        with pytest.raises(RequestRefused, match="read-only"):
            await write
    assert made.sent() == []
    assert (await made.line.read(THERE, 100)).words == (100,)


async def test_describe_limits_the_requests_to_a_device(end: Open) -> None:
    made = end()
    made.line.describe(THERE, CAUTIOUS)
    with pytest.raises(RequestRefused, match="function 6"):
        await made.line.write(THERE, 100, [5])
    with pytest.raises(RequestRefused, match="accepts 1"):
        await made.line.read(THERE, 100, 2)
    only_16 = Limits(frozenset({3, 16}), max_read=9, max_write=9, max_read_23=0, max_write_23=0)
    made.line.describe(THERE, only_16)
    await made.line.write(THERE, 100, [5])
    assert made.sent() == [bytes.fromhex("10 0064 0001 02 0005")]
    with pytest.raises(RequestRefused):
        await made.line.write(THERE, 100, [0x10000])
    with pytest.raises(RequestRefused):
        await made.line.read(3, 100, 2)  # it has no description


async def test_forbidden_request_is_not_sent_at_last_moment(end: Open) -> None:
    made = end()
    with pytest.raises(RequestRefused, match="A stop came"):
        await made.line.write(THERE, 100, [6], forbidden=lambda: "A stop came.")
    with pytest.raises(RequestRefused, match="A stop came"):
        await made.line.read_write(THERE, 100, 1, 100, [6], forbidden=lambda: "A stop came.")
    assert made.sent() == []
    await made.line.write(THERE, 100, [5], forbidden=lambda: "")
    assert (await made.line.read(THERE, 100)).words == (5,)


async def test_identify_diagnose_and_broadcast_send_their_functions(end: Open) -> None:
    made = end()
    found = await made.line.identify(THERE)
    assert (found.conformity, found.objects) == (1, IDENTITY)
    assert await made.line.diagnose(THERE, 0, 0x1234) == 0x1234
    await made.line.broadcast(100, [3], limits=WIDE)
    with pytest.raises(RequestRefused):
        await made.line.broadcast(100, [3], limits=CAUTIOUS)
    await made.line.read(THERE, 101)
    assert [pdu[0] for pdu in made.sent()] == [43, 8, 6, 3]


async def test_device_without_function_43_is_identified_by_17(end: Open) -> None:
    made = end()
    made.line.describe(THERE, CAUTIOUS)
    found = await made.line.identify(THERE, function=17)
    assert (found.conformity, found.objects) == (0, {1: IDENTITY[0]})
    assert made.sent() == [bytes([17])]


async def test_caller_sets_wait_for_unknown_device(end: Open) -> None:
    made = end(timing=Timing(first_timeout=600.0, scan_timeout=600.0, retries=0))
    with pytest.raises(NoAnswer):
        await made.line.read(SILENT, 100, priority=Priority.BACKGROUND, within=0.01)
    with pytest.raises(NoAnswer):
        await made.line.identify(SILENT, priority=Priority.BACKGROUND, within=0.01)
    assert len(made.sent()) == 2


async def test_probe_of_silent_device_waits_for_no_back_off() -> None:
    held.update(HELD | {17: 0})  # function 17 meets silence
    with TcpPeer(device) as peer:
        timing = replace(PATIENT, back_off_first=600.0, back_off_longest=600.0, retries=0)
        line = Line(RtuTcpLink("127.0.0.1", peer.port), timing=timing)
        line.open(wait=10.0)
        try:
            await line.read(THERE, 100)
            for _ in range(3):
                with pytest.raises(NoAnswer):
                    await line.identify(
                        THERE, priority=Priority.BACKGROUND, within=0.01, function=17
                    )
            with pytest.raises(NoAnswer, match="Retrying in"):
                await line.read(THERE, 100, priority=Priority.POLL)
            assert (await line.read(THERE, 100, priority=Priority.POLL, within=5.0)).words
            assert line.counters.timeouts == 0
            assert line.counters.searched == 3
        finally:
            line.close()


async def test_closing_the_line_ends_pending_requests(end: Open) -> None:
    made = end()
    states: list[LineStatus] = []
    begun = asyncio.Event()
    here = asyncio.get_running_loop()

    async def work() -> None:
        here.call_soon_threadsafe(begun.set)
        await asyncio.sleep(600)

    def note(event: StateChanged) -> None:
        states.append(event.state.status)

    on_event(made.line.facts, StateChanged, note)
    unheard: list[StateChanged] = []
    on_event(made.line.facts, StateChanged, unheard.append)()
    worker: LineWorker = made.line.spawn(work, "work")
    await begun.wait()
    assert not worker.done()
    assert made.line.state.status is LineStatus.CONNECTED
    made.line.close()
    made.line.close()
    for _ in range(500):
        if worker.done() and states:
            break
        await asyncio.sleep(0.01)
    assert worker.done()
    assert (made.line.state.status, states[-1]) == (LineStatus.CLOSED, LineStatus.CLOSED)
    assert unheard == []
    with pytest.raises(LineClosed):
        await made.line.read(THERE, 100)
    with pytest.raises(LineClosed):
        made.line.spawn(work, "work")


# Settings of the fake


@pytest.fixture
def line() -> FakeLine:
    """A fake line with one device."""
    made = FakeLine({THERE: HELD})
    made.describe(THERE, WIDE)
    return made


async def test_fake_read_fails_as_often_as_set_and_at_its_address_only(line: FakeLine) -> None:
    line.fail_read(THERE, 103, NoAnswer(THERE, 3, 103), times=2)
    line.fail_read(THERE, 105, 6)
    await line.read(THERE, 100, 3)
    for _ in range(2):
        with pytest.raises(NoAnswer):
            await line.read(THERE, 102, 3)
    assert (await line.read(THERE, 102, 3)).words == (102, 103, 104)
    for _ in range(3):
        with pytest.raises(DeviceException, match="busy"):
            await line.read(THERE, 104, 3)
    line.fail_read(THERE, 105, 6, times=0)
    await line.read(THERE, 104, 3)
    await line.write(THERE, 103, [1])


async def test_fake_write_fails_only_if_it_writes_the_register(line: FakeLine) -> None:
    line.fail_write(THERE, 102, 4)
    await line.write(THERE, 101, [1])
    await line.write(THERE, 103, [1, 1])
    await line.write(THERE, 100, [1, 1])
    for first, values in ((102, [1]), (100, [1, 1, 1]), (102, [1, 1])):
        with pytest.raises(DeviceException):
            await line.write(THERE, first, values)


@pytest.mark.parametrize("taken", [False, True])
async def test_write_without_a_reply_has_an_unknown_outcome(line: FakeLine, taken: bool) -> None:
    line.fail_write(THERE, None, NoAnswer(THERE, 6, 100), times=1, taken=taken)
    with pytest.raises(NoAnswer):
        await line.write(THERE, 100, [5])
    assert line.devices[THERE].words[100] == (5 if taken else 100)
    assert line.requests == [WriteOne(THERE, 100, 5)]
    await line.write(THERE, 100, [6])
    assert line.devices[THERE].words[100] == 6


async def test_unsent_request_is_not_in_log(line: FakeLine) -> None:
    line.fail_write(THERE, 100, Superseded(THERE, 100))
    with pytest.raises(Superseded):
        await line.write(THERE, 100, [5])
    line.become(LineStatus.LOST, "gone")
    with pytest.raises(LineLost, match="gone"):
        await line.read(THERE, 100)
    assert line.requests == []
    line.become(LineStatus.CONNECTED)
    await line.read(THERE, 100)
    assert line.requests == [Read(THERE, 100, 1)]


async def test_fake_device_counts_failures_until_it_answers_again(line: FakeLine) -> None:
    line.silence(THERE)
    for failures in (1, 2):
        with pytest.raises(NoAnswer):
            await line.identify(THERE)
        assert line.device_state(THERE).failures == failures
    line.silence(THERE, False)
    with pytest.raises(DeviceException):  # it has no identity, which is an answer
        await line.identify(THERE)
    assert (line.device_state(THERE).failures, line.requests) == (0, [Identify(THERE)] * 3)


async def test_slow_reply_does_not_block_and_returns_words_of_the_request(
    line: FakeLine,
) -> None:
    line.delay(THERE, 0.05)
    requested = asyncio.ensure_future(line.read(THERE, 100))
    await asyncio.sleep(0)
    assert line.requests == [Read(THERE, 100, 1)]
    line.devices[THERE].words[100] = 1
    assert not requested.done()
    assert (await requested).words == (100,)
