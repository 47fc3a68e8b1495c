"""The holder of a line keeps devices from their communication timeout, for the programs on it."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

import msgspec
import pytest

from tests.limits import READS_PER_TIMEOUT
from tui.bus.errors import NoAnswer
from tui.bus.keep_alive import LONGEST_TIMEOUT, SHORTEST_TIMEOUT, KeepAlive
from tui.bus.line import Line
from tui.bus.model import Priority, Timing
from tui.bus.program import Program
from tui.bus.requests import Identify, ReadInput
from tui.bus.schedule.alive_reads import AliveReads
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job
from tui.bus.share.messages import NoMessage, packed, unpacked
from tui.bus.shared_state import SharedState

from .conftest import OpenLine, Share
from .peer import PtyPeer, eventually, honest, honest_pdu
from .sharing import frozen

TIMEOUT = 4.0
PERIOD = TIMEOUT / READS_PER_TIMEOUT
ADDRESS = 77
ONE = KeepAlive(1, TIMEOUT, ADDRESS)


class Bench:
    """Reads of one line as time passes; each is answered, or fails, immediately."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.answers = True
        self.sent: list[tuple[float, int, Priority]] = []
        """When which device was read, and how urgently."""
        self.programs: list[str] = []
        self.facts = SharedState(Program("me", "panel", 1))
        self.devices = Devices(Timing(), mistakable=True)
        self._reads = AliveReads(self.devices, self.facts, lambda: self.now, self._submit)

    def _submit(self, job: Job) -> None:
        self.sent.append((round(self.now - 1000.0, 3), job.request.device, job.priority))
        self.programs.append(job.program)
        if self.answers:
            self.devices[job.request.device].heard = self.now
            job.finish(job.reply(honest_pdu(job.pdu), self.now))
        else:
            job.fail(NoAnswer(1, 3, 77))

    def wait(self, seconds: float) -> None:
        """Look whenever a look is due."""
        end = self.now + seconds
        while (due := self._reads.put_due()) < end:
            self.now = max(due, self.now + 0.001)
        self.now = end

    def hear(self, device: int = 1) -> None:
        """Some program has read it."""
        self.devices[device].heard = self.now


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_device_is_read_four_times_in_its_timeout(bench: Bench) -> None:
    bench.facts.keep_alives.keep(ONE)
    bench.wait(TIMEOUT + 0.1)
    times = [PERIOD, 2 * PERIOD, 3 * PERIOD, 4 * PERIOD]
    assert bench.sent == [(time, 1, Priority.FEED) for time in times]


def test_device_read_by_a_program_needs_no_keep_alive_reads(bench: Bench) -> None:
    bench.facts.keep_alives.keep(ONE)
    for _ in range(10):
        bench.wait(0.9 * PERIOD)
        bench.hear()
    assert bench.sent == []


def test_shortest_timeout_of_all_programs_applies(bench: Bench) -> None:
    """Its share of the line counts for that program, and a pause of polling holds for it."""
    bench.facts.keep_alives.keep(ONE)
    bench.facts.keep_alives.hear("other", KeepAlive(1, TIMEOUT / 2, ADDRESS))
    bench.wait(PERIOD / 2 + 0.1)
    assert bench.programs == ["other"]
    bench.facts.keep_alives.end("other")
    bench.wait(PERIOD)
    assert bench.programs == ["other", "me"]


def test_timed_out_device_is_read_after_the_others(bench: Bench) -> None:
    bench.answers = False
    bench.facts.keep_alives.keep(ONE)
    bench.wait(TIMEOUT + 2.1)
    before = [priority for time, _, priority in bench.sent if time < TIMEOUT]
    after = [priority for time, _, priority in bench.sent if time >= TIMEOUT]
    assert set(before) == {Priority.FEED}
    assert set(after) == {Priority.POLL}
    # not without a pause either
    assert len(before) == 1 + (TIMEOUT - PERIOD) / (PERIOD / 2) - 1
    assert len(after) <= 1 + 2.1 / (PERIOD / 2)


def test_keep_alive_reads_end_with_the_program_or_at_their_deadline(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.keep_alive.time.monotonic", lambda: bench.now)
    bench.facts.keep_alives.hear("other", ONE)
    bench.facts.hear_gone(Program("other", "run", 2))
    bench.facts.keep_alives.keep(KeepAlive(2, TIMEOUT, ADDRESS))
    bench.facts.keep_alives.let_go(2)
    bench.wait(10 * TIMEOUT)
    assert bench.sent == []
    bench.facts.keep_alives.keep(ONE, seconds=TIMEOUT)
    bench.wait(10 * TIMEOUT)
    assert len(bench.sent) == READS_PER_TIMEOUT - 1


def test_waiting_keep_alive_read_is_not_queued_twice(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    waiting: list[Job] = []
    monkeypatch.setattr(bench._reads, "_submit", waiting.append)
    bench.facts.keep_alives.keep(ONE)
    bench.wait(3 * PERIOD)
    assert len(waiting) == 1


def test_keep_alive_uses_the_request_of_its_function() -> None:
    assert KeepAlive(3, TIMEOUT, function=43).request == Identify(3)
    assert KeepAlive(3, TIMEOUT, 5, 2, 4).request == ReadInput(3, 5, 2)


@pytest.mark.parametrize(
    "wrong",
    [
        {"timeout": SHORTEST_TIMEOUT / 2},
        {"timeout": math.nan},
        {"timeout": math.inf},
        {"device": 0},
        {"device": 256},
        {"count": 0},
        {"count": 126},
        {"function": 6},
        {"address": 1 << 16},
    ],
)
def test_malformed_message_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(NoMessage):
        unpacked(packed(msgspec.structs.replace(ONE, **wrong))[4:])


@pytest.mark.parametrize("timeout", [0.001, 1e9])
def test_timeout_is_clamped_to_its_bounds(timeout: float) -> None:
    facts = SharedState()
    facts.keep_alives.keep(KeepAlive(1, timeout, ADDRESS))
    (alive,) = facts.keep_alives.of(facts.me.id)
    assert SHORTEST_TIMEOUT <= alive.timeout <= LONGEST_TIMEOUT
    assert unpacked(packed(alive)[4:]) == alive


# On a line


def reads(peer: PtyPeer) -> int:
    """Count the reads of the keep-alive register."""
    return sum(
        request[1] == 3 and int.from_bytes(request[2:4], "big") == ADDRESS
        for request in peer.requests
    )


async def more(peer: PtyPeer) -> None:
    """Wait until it was read some times more."""
    before = reads(peer)
    await asyncio.to_thread(eventually, lambda: reads(peer) >= before + 3)


QUICKLY = KeepAlive(1, 0.4, ADDRESS)


async def test_unshared_line_keeps_its_devices_alive(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        line.facts.keep_alives.keep(QUICKLY)
        await more(peer)


async def test_holder_keeps_devices_alive_while_their_program_hangs(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        holder, program = lines.open("keeper"), lines.open("run")
        program.facts.keep_alives.keep(QUICKLY)
        await asyncio.to_thread(eventually, lambda: bool(holder.facts.keep_alives.kept))
        with frozen(program):
            await more(peer)


async def test_next_holder_keeps_devices_of_attached_programs_alive_only(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        holder, program, last = (lines.open(name) for name in ("keeper", "run", "panel"))
        program.facts.keep_alives.keep(QUICKLY)
        await asyncio.to_thread(eventually, lambda: bool(holder.facts.keep_alives.kept))
        await asyncio.to_thread(holder.close)
        await more(peer)
        await asyncio.to_thread(program.close)
        await asyncio.to_thread(eventually, _holds(last))
        count = reads(peer)
        await asyncio.sleep(3 * QUICKLY.timeout)
        assert reads(peer) == count


def _holds(line: Line) -> Callable[[], bool]:
    """True if one program holds the line alone, and keeps nothing alive."""
    facts = line.facts
    return lambda: facts.programs == (facts.me,) and not facts.keep_alives.kept


async def test_device_whose_polling_is_paused_is_not_read(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        holder, program = lines.open("keeper"), lines.open("prove")
        holder.facts.keep_alives.keep(QUICKLY)
        await more(peer)
        program.facts.pause_polling(1, "a test of its timeout")
        await asyncio.to_thread(eventually, lambda: 1 in holder.facts.paused)
        await asyncio.sleep(QUICKLY.timeout / 2)  # what is on the wire
        count = reads(peer)
        await asyncio.sleep(3 * QUICKLY.timeout)
        assert reads(peer) == count
