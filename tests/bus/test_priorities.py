"""Order of requests, and the small cost of one silent drive for the others."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Awaitable, Callable, Sequence

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineBusy, NoAnswer, RequestRefused
from tui.bus.line import Timing

from .conftest import OpenLine, sent
from .peer import PtyPeer, Step, honest, reply, silent
from .plain import outcome, plain_serial

DEAD = 9


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.1, reply(request)]


def one_dead(request: bytes, _count: int) -> Sequence[Step]:
    return [] if request[0] == DEAD else [reply(request)]


async def test_plain_client_serves_first_come_first_served() -> None:
    with PtyPeer(slow) as peer:
        async with plain_serial(peer.path, timeout=2.0) as client:
            polls = [
                client.read_holding_registers(address, count=1, device_id=1) for address in range(5)
            ]
            await asyncio.gather(*polls, client.write_register(99, 0, device_id=1))
        assert [request[1] for request in peer.requests].index(6) == 5


async def test_urgent_requests_overtake(
    open_line: OpenLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    # on a busy machine exchanges take long: a kind kept below its share would go first
    monkeypatch.setattr("tui.bus.schedule.queue.OVERDUE", math.inf)
    all_wait = threading.Event()

    def until_all_wait(request: bytes, count: int) -> Sequence[Step]:
        assert count or all_wait.wait(20)
        return [reply(request)]

    with PtyPeer(until_all_wait) as peer:
        line = open_line(peer.path, Timing(first_timeout=30.0, min_timeout=30.0))
        waiting = [asyncio.create_task(line.read(1, 50))]
        await asyncio.to_thread(peer.await_requests, 1)
        # backwards, so that only the priority can bring them in order
        for priority in reversed(Priority):
            waiting.append(asyncio.create_task(line.read(1, int(priority), priority=priority)))
            await asyncio.sleep(0)
        all_wait.set()
        await asyncio.gather(*waiting)
        assert [request[3] for request in peer.requests] == [50, *range(len(Priority))]


@pytest.mark.parametrize("function", [6, 16, 23])
async def test_write_forbidden_while_it_waits_is_not_sent(
    open_line: OpenLine, function: int
) -> None:
    with PtyPeer(slow) as peer:
        line = open_line(peer.path)
        before = asyncio.create_task(line.read(1, 50))
        await asyncio.to_thread(peer.await_requests, 1)
        why = [""]
        if function == 23:
            work: Awaitable[object] = line.read_write(1, 60, 1, 99, [7], forbidden=lambda: why[0])
        else:
            work = line.write(1, 99, [7], multiple=function == 16, forbidden=lambda: why[0])
        waiting = asyncio.ensure_future(work)
        await asyncio.sleep(0.02)
        why[0] = "A stop came."
        with pytest.raises(RequestRefused, match=r"^A stop came\.$"):
            await waiting
        await before
        # the next one is requested again
        why[0] = ""
        await line.write(1, 99, [8], forbidden=lambda: why[0])
        assert [request[1] for request in peer.requests] == [3, 6]


async def test_stop_waits_for_the_exchange_in_flight_only(open_line: OpenLine) -> None:
    def silent_for_reads(request: bytes, _count: int) -> Sequence[Step]:
        return [reply(request)] if request[1] == 6 else []

    # the dead reads leave late replies awaited and polls backed off: the stop minds neither
    timing = Timing(first_timeout=0.2, min_timeout=0.2, late_reply=60.0)
    with PtyPeer(silent_for_reads) as peer:
        line = open_line(peer.path, timing)
        reads = [
            asyncio.create_task(line.read(1, address, priority=Priority.OPERATOR_READ))
            for address in range(5)
        ]
        await asyncio.to_thread(peer.await_requests, 1)
        await line.write(1, 99, [0], priority=Priority.STOP)
        assert [request[1] for request in peer.requests] == [3, 6]
        for task in reads:
            task.cancel()


async def test_stop_is_repeated_although_its_reply_may_be_late(
    open_line: OpenLine,
) -> None:
    def second(request: bytes, count: int) -> Sequence[Step]:
        return [] if count == 0 else [reply(request)]

    timing = Timing(first_timeout=0.2, min_timeout=0.2, late_reply=60.0)
    with PtyPeer(second) as peer:
        line = open_line(peer.path, timing)
        with pytest.raises(NoAnswer):
            await line.write(1, 99, [0], priority=Priority.STOP)
        await line.write(1, 99, [0], priority=Priority.STOP)
        # several words: a late reply to the first could be taken for that to the second
        peer.script = silent
        with pytest.raises(NoAnswer):
            await line.write(1, 99, [0, 0], priority=Priority.STOP)
        peer.script = honest
        with pytest.raises(NoAnswer):
            await line.write(1, 99, [0, 0], priority=Priority.STOP)
        assert len(peer.requests) == 4


async def test_plain_client_blocks_the_line_for_a_dead_drive() -> None:
    with PtyPeer(one_dead) as peer:
        async with plain_serial(peer.path, timeout=0.2, retries=3) as client:
            dead = asyncio.create_task(
                outcome(client.read_holding_registers(1, count=1, device_id=DEAD))
            )
            await asyncio.sleep(0.05)
            begun = time.monotonic()
            await outcome(client.read_holding_registers(1, count=1, device_id=1))
            assert time.monotonic() - begun >= 0.7
            assert await dead is None


async def test_dead_drive_costs_one_timeout_per_back_off_period(open_line: OpenLine) -> None:
    timing = Timing(first_timeout=0.2, min_timeout=0.2, back_off_first=60.0, late_reply=0.3)
    with PtyPeer(one_dead) as peer:
        line = open_line(peer.path, timing)
        for address in range(20):
            with pytest.raises(NoAnswer) as caught:
                await line.read(DEAD, address)
            assert (await line.read(1, address)).words == (address,)
        assert len(peer.requested(DEAD)) == 1
        assert len(peer.requested(1)) == 20
        assert caught.value.retry_in is not None
        assert 0 < caught.value.retry_in <= 60.0
        assert "Retrying in" in str(caught.value)
        state = line.device_state(DEAD)
        assert state.answers is False
        assert state.failures == 1
        assert state.next_try is not None
        assert line.device_state(1).answers is True
        assert line.device_state(8).answers is None


async def test_operator_request_is_sent_during_the_back_off(open_line: OpenLine) -> None:
    timing = Timing(first_timeout=0.2, min_timeout=0.2, back_off_first=60.0, late_reply=0.3)
    with PtyPeer(one_dead) as peer:
        line = open_line(peer.path, timing)
        with pytest.raises(NoAnswer):
            await line.read(DEAD, 1)
        peer.script = honest
        got = await line.read(DEAD, 2, priority=Priority.OPERATOR_READ)
        assert got.words == (2,)
        # it answers: polls are sent again immediately
        assert (await line.read(DEAD, 3)).words == (3,)


async def test_polls_resume_after_the_back_off(open_line: OpenLine) -> None:
    timing = Timing(first_timeout=0.1, min_timeout=0.1, back_off_first=0.3, late_reply=0.1)
    with PtyPeer(one_dead) as peer:
        line = open_line(peer.path, timing)
        for failures in (1, 2):
            with pytest.raises(NoAnswer):
                await line.read(DEAD, 1)
            state = line.device_state(DEAD)
            assert state.failures == failures
            assert state.next_try is not None
            await asyncio.sleep(max(0.0, state.next_try - time.monotonic()) + 0.01)
        first, second = sent(line)
        assert second - first >= 0.3
        peer.script = honest
        assert (await line.read(DEAD, 2)).words == (2,)


async def test_full_queue_refuses_polls_but_not_stops(open_line: OpenLine) -> None:
    def very_slow(request: bytes, count: int) -> Sequence[Step]:
        return [1.0 if count == 0 else 0.0, reply(request)]

    with PtyPeer(very_slow) as peer:
        line = open_line(peer.path, Timing(first_timeout=5.0, queue_length=8))
        flying = asyncio.create_task(line.read(1, 0))
        await asyncio.to_thread(peer.await_requests, 1)
        polls = [asyncio.create_task(line.read(1, n)) for n in range(4)]
        await asyncio.sleep(0.05)
        with pytest.raises(LineBusy):
            await line.read(1, 20)
        others = [
            asyncio.create_task(line.read(1, n, priority=Priority.OPERATOR_READ)) for n in range(4)
        ]
        await asyncio.sleep(0.05)
        with pytest.raises(LineBusy):
            await line.write(1, 20, [1])
        await line.write(1, 99, [0], priority=Priority.STOP)
        await asyncio.gather(flying, *polls, *others)
        assert peer.requests[1][3] == 99


async def test_read_only_line_refuses_all_changes(open_line: OpenLine) -> None:
    from .conftest import WIDE

    with PtyPeer(honest) as peer:
        line = open_line(peer.path, read_only=True)
        calls: list[Callable[[], Awaitable[object]]] = [
            lambda: line.write(1, 5, [7]),
            lambda: line.write(1, 5, [7], priority=Priority.STOP),
            lambda: line.write(1, 5, [7, 8]),
            lambda: line.read_write(1, 5, 1, 6, [7]),
            lambda: line.broadcast(5, [7], limits=WIDE),
            lambda: line.diagnose(1, 10),
        ]
        for call in calls:
            with pytest.raises(RequestRefused, match="read-only"):
                await call()
        assert (await line.read(1, 5)).words == (5,)
        assert await line.diagnose(1, 0, 7) == 7
        assert len(peer.requests) == 2


async def test_undescribed_device_gets_single_reads_only(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        assert (await line.read(77, 5)).words == (5,)
        for refused in (line.read(77, 5, 2), line.write(77, 5, [1]), line.diagnose(77, 0)):
            with pytest.raises(RequestRefused):
                await refused
        assert len(peer.requests) == 1
