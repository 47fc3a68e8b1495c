"""A line whose holder was killed: late replies to it are never taken for other replies."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.bus.limits import Limits
from tui.bus.line import Line

from .conftest import NO_ECHO, WIDE, OpenLine, Share, sent
from .peer import PtyPeer, Step, eventually, reply
from .sharing import QUICK, OtherProgram, other_program

LATE = 2.5
"""Seconds for which a reply may be late."""
SLOW, OTHER = 77, 8


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.5, reply(request)] if request[3] == SLOW else [reply(request)]


def never_echoes(request: bytes, count: int) -> Sequence[Step]:
    return [] if request[1] == 8 else slow(request, count)


def functions(peer: PtyPeer) -> list[int]:
    return [request[1] for request in peer.requests]


async def killed_while_it_waits(owner: OtherProgram, peer: PtyPeer) -> float:
    """Kill the holder of a line while a reply to it is on its way; returns when."""
    owner.tell("read 1")
    owner.tell(f"ask {SLOW}")
    await asyncio.to_thread(peer.await_requests, 2)
    return await asyncio.to_thread(owner.kill)


def next_program(share: Share, peer: PtyPeer, limits: Limits, patience: float = 1.5) -> Line:
    """A program that opens the line after it, and waits this many seconds for a reply."""
    timing = replace(QUICK, late_reply=LATE, first_timeout=patience, min_timeout=patience)
    line = share(peer.path).open("watch", timing=timing)
    line.describe(1, limits)
    return line


async def test_values_return_once_the_drive_has_echoed_a_number(
    share: Share, tmp_path: Path
) -> None:
    with PtyPeer(slow) as peer, other_program(peer.path, tmp_path, "run", LATE) as owner:
        killed = await killed_while_it_waits(owner, peer)
        line = await asyncio.to_thread(next_program, share, peer, WIDE)
        # the reply to the killed program arrives first, and has the form of the reply to this read
        assert (await line.read(1, OTHER)).words == (OTHER,)
        assert time.monotonic() - killed < 1.0
        # the read between shows if the adapter echoes
        assert functions(peer) == [3, 3, 3, 8, 3]
        await line.read(1, OTHER)
        assert functions(peer) == [3, 3, 3, 8, 3, 3], "once is enough"


@pytest.mark.parametrize("why", ["it has no echo", "it never echoes"])
async def test_drive_without_echo_waits_until_no_late_reply_can_come(
    share: Share, tmp_path: Path, why: str
) -> None:
    drive, limits = (slow, NO_ECHO) if why == "it has no echo" else (never_echoes, WIDE)
    with PtyPeer(drive) as peer, other_program(peer.path, tmp_path, "run", LATE) as owner:
        killed = await killed_while_it_waits(owner, peer)
        line = await asyncio.to_thread(next_program, share, peer, limits, 0.8)
        assert (await line.read(1, OTHER)).words == (OTHER,)
        assert time.monotonic() - killed >= LATE
        assert functions(peer).count(8) <= 2


async def test_stop_words_do_not_wait_for_the_proof(share: Share, tmp_path: Path) -> None:
    with PtyPeer(slow) as peer, other_program(peer.path, tmp_path, "run", LATE) as owner:
        killed = await killed_while_it_waits(owner, peer)
        line = await asyncio.to_thread(next_program, share, peer, NO_ECHO)
        other = asyncio.create_task(line.write(1, 1, [15]))
        stop = asyncio.create_task(line.write(1, 1, [0], priority=Priority.STOP))
        await asyncio.to_thread(eventually, lambda: 6 in functions(peer))
        assert time.monotonic() - killed < 1.0
        assert peer.requests[-1][5] == 0
        await asyncio.gather(stop, other, return_exceptions=True)
        assert time.monotonic() - killed >= LATE


def busy_once(request: bytes, count: int) -> Sequence[Step]:
    """A drive that receives all requests and answers them in order."""
    return [0.55 if count == 0 else 0.03, reply(request)]


def doubting(open_line: OpenLine, peer: PtyPeer, seconds: float) -> Line:
    """A line whose last holder was killed: a late reply may arrive for this many seconds."""
    timing = replace(QUICK, late_reply=LATE, first_timeout=0.2, min_timeout=0.2)
    line = open_line(peer.path, timing)
    line._engine._dispatcher.proof.doubt(time.monotonic() + seconds)
    return line


async def test_late_replies_to_a_failed_proof_are_not_used(
    open_line: OpenLine,
) -> None:
    with PtyPeer(busy_once) as peer:
        line = doubting(open_line, peer, 0.3)
        found = []
        for register in (SLOW, OTHER, 9, 10):
            with suppress(NoAnswer):
                answer = await line.read(1, register, priority=Priority.OPERATOR_READ)
                found.append((register, answer.words[0]))
        assert [wanted for wanted, _ in found] == [word for _, word in found]
        assert len(found) >= 3


async def test_write_that_waits_for_a_proof_can_be_cancelled(open_line: OpenLine) -> None:
    with PtyPeer(never_echoes) as peer:
        line = doubting(open_line, peer, 1.2)
        write = asyncio.create_task(line.write(1, 1, [15]))
        await asyncio.to_thread(eventually, lambda: 8 in functions(peer))
        write.cancel()
        await line.read(1, OTHER)
        assert 6 not in functions(peer)


async def test_stop_waits_for_one_request_of_a_proof_at_most(open_line: OpenLine) -> None:
    def silent_at_1(request: bytes, _count: int) -> Sequence[Step]:
        return [] if request[0] == 1 else [reply(request)]

    with PtyPeer(silent_at_1) as peer:
        line = doubting(open_line, peer, 5.0)
        reading = asyncio.create_task(line.read(1, OTHER))
        await asyncio.to_thread(peer.await_requests, 1)
        await line.write(2, 1, [0], priority=Priority.STOP)
        # nor does a healthy drive wait for a silent one
        await line.read(2, OTHER)
        assert [data[0] for data in peer.requests][:2] == [1, 2]
        assert [data[0] for data in peer.requests].count(1) == 1
        reading.cancel()


def writes(peer: PtyPeer) -> list[int]:
    """The words that were written, in their order."""
    return [int.from_bytes(request[4:6], "big") for request in peer.requests if request[1] == 6]


async def test_stop_is_repeated_when_line_is_quiet(open_line: OpenLine) -> None:
    with PtyPeer(slow) as peer:
        line = doubting(open_line, peer, 0.6)
        line.describe(1, NO_ECHO)
        until = time.monotonic() + 0.6
        run = asyncio.create_task(line.write(1, 1, [15]))
        await line.write(1, 1, [0], priority=Priority.STOP)
        assert time.monotonic() < until
        await run
        assert writes(peer) == [0, 0, 15], "before what starts the motor again"
        times = [at for at, number in zip(sent(line), functions(peer), strict=True) if number == 6]
        assert times[0] < until - 0.3 < until - 0.1 < times[1]


async def test_stop_is_repeated_when_drive_has_echoed_a_number(open_line: OpenLine) -> None:
    with PtyPeer(slow) as peer:
        line = doubting(open_line, peer, 60.0)
        await line.write(1, 1, [0], priority=Priority.STOP)
        await asyncio.to_thread(eventually, lambda: writes(peer) == [0, 0])
        assert functions(peer) == [6, 3, 8, 6]
        await line.write(1, 1, [0], priority=Priority.STOP)
        await line.read(1, OTHER)
        assert functions(peer) == [6, 3, 8, 6, 6, 3], "once is enough"


async def test_unanswered_stop_is_repeated(open_line: OpenLine) -> None:
    def deaf_at_first(request: bytes, count: int) -> Sequence[Step]:
        return [] if count == 0 else [reply(request)]

    with PtyPeer(deaf_at_first) as peer:
        line = doubting(open_line, peer, 0.6)
        line.describe(1, NO_ECHO)
        with pytest.raises(NoAnswer):
            await line.write(1, 1, [0], priority=Priority.STOP)
        await asyncio.to_thread(eventually, lambda: writes(peer) == [0, 0])


async def test_only_last_stop_of_a_drive_is_repeated(open_line: OpenLine) -> None:
    with PtyPeer(slow) as peer:
        line = doubting(open_line, peer, 0.6)
        line.describe(1, NO_ECHO)
        for word in (7, 0):
            await line.write(1, 1, [word], priority=Priority.STOP)
        await line.read(1, OTHER)
        assert writes(peer) == [7, 0, 0]


async def test_stop_of_one_drive_precedes_the_repeat_of_another(open_line: OpenLine) -> None:
    with PtyPeer(never_echoes) as peer:
        line = doubting(open_line, peer, 60.0)
        await line.write(1, 1, [0], priority=Priority.STOP)
        before = len(peer.requests)
        await line.write(2, 1, [0], priority=Priority.STOP)
        # one of them may have been on the line
        assert 2 in [request[0] for request in peer.requests[before : before + 2]]
