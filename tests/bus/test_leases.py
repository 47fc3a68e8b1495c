"""A device is written only if its program has armed it, as the line's holder knows.

The programs in these tests do not check it, like one that hangs or is wrong.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from types import SimpleNamespace

import pytest

from tests.limits import LEASE_RENEWED_EVERY
from tests.line_events import on_event
from tui.bus.api import Priority
from tui.bus.bounds import MOST_CARE
from tui.bus.errors import RequestRefused
from tui.bus.leases import LEASE_ENDED, WriteLease, WriteLeases
from tui.bus.line import Line
from tui.bus.line_events import StopDue, WriteAbandoned
from tui.bus.program import Program
from tui.bus.share.messages import Armed
from tui.bus.stop_counts import StopCounts

from .conftest import Share
from .peer import PtyPeer, Step, eventually, reply
from .sharing import SharedLines

CARE = b"what stops it"
RUN, STOP = 15, 0


def prompt(request: bytes, _count: int) -> Sequence[Step]:
    return [reply(request)]


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.5, reply(request)]


def written(peer: PtyPeer) -> list[int]:
    """The word of every single write on the wire."""
    return [word for _, word in peer.words_written]


async def refusal(line: Line) -> str:
    """Why the holder does not send a write to device 1."""
    with pytest.raises(RequestRefused) as caught:
        await line.write(1, 1, [RUN])
    return str(caught.value)


def pair(share: Share, peer: PtyPeer) -> tuple[Line, Line]:
    """The holder of a line, and a program that is attached."""
    lines = share(peer.path)
    return lines.open("keeper", gated=True), lines.open("run")


async def test_disarmed_drive_is_sent_stops_only(share: Share) -> None:
    with PtyPeer(prompt) as peer:
        holder, program = pair(share, peer)
        for line in (holder, program):
            assert await refusal(line) == "Not sent: drive 1 is not armed by this program."
        assert written(peer) == []
        await program.write(1, 1, [STOP], priority=Priority.STOP)
        await program.read(1, 1)
        assert written(peer) == [STOP]


async def test_armed_drive_is_written_until_it_is_disarmed(share: Share) -> None:
    with PtyPeer(prompt) as peer:
        holder, program = pair(share, peer)
        for line in (holder, program):
            line.facts.leases.arm(1, 60.0, CARE)
            await line.write(1, 1, [RUN])
            line.facts.leases.disarm(1)
            assert "drive 1 is not armed" in await refusal(line)
        program.facts.leases.arm(2, 60.0, CARE)
        assert "drive 1 is not armed by this program" in await refusal(program)
        assert written(peer) == [RUN, RUN]


async def test_stop_ends_the_lease_of_every_program(share: Share) -> None:
    with PtyPeer(prompt) as peer:
        holder, program = pair(share, peer)
        program.facts.leases.arm(1, 60.0, CARE)
        await program.write(1, 1, [RUN])
        holder.facts.give_stop([1], "the stop key")
        await asyncio.to_thread(eventually, lambda: program.facts.stops.stamp(1) == 1)
        # it knows the stop, and believes that its drive is still armed
        assert await refusal(program) == "Not sent: drive 1 was stopped after it was armed."
        program.facts.leases.arm(1, 60.0, CARE)
        await program.write(1, 1, [RUN])
        assert written(peer) == [RUN, RUN]


async def test_lease_expires_unless_renewed(share: Share) -> None:
    with PtyPeer(prompt) as peer:
        _, program = pair(share, peer)
        program.facts.leases.arm(1, -LEASE_RENEWED_EVERY - 0.01, CARE)
        assert await refusal(program) == "Not sent: drive 1 is not armed now."
        program.facts.leases.stay_armed(1, 60.0)
        await program.write(1, 1, [RUN])
        program.facts.leases.arm(1, None, CARE)
        program.facts.leases.stay_armed(1, -60.0)
        await program.write(1, 1, [RUN])
        assert written(peer) == [RUN, RUN]


async def test_drive_without_stop_instructions_is_not_written(share: Share) -> None:
    heard: list[tuple[int, bytes]] = []

    def take(device: int, care: bytes) -> bool:
        heard.append((device, care))
        return care == CARE

    with PtyPeer(prompt) as peer:
        holder, program = pair(share, peer)
        holder.facts.accepts_care = take
        for care in (b"", b"garbage", bytes(MOST_CARE + 1)):
            program.facts.leases.arm(1, 60.0, care)
            assert "does not know how to stop drive 1" in await refusal(program)
        program.facts.leases.arm(1, 60.0, CARE)
        await program.write(1, 1, [RUN])
        program.facts.leases.arm(1, 60.0, b"garbage")
        assert "does not know how to stop drive 1" in await refusal(program)
        assert heard == [(1, b"garbage"), (1, CARE), (1, b"garbage")]
        assert written(peer) == [RUN]


async def test_next_holder_takes_over_leases(share: Share) -> None:
    with PtyPeer(prompt) as peer:
        lines = share(peer.path)
        first, *others = (lines.open(name, gated=True) for name in ("first", "second", "third"))
        for other in others:
            other.facts.leases.arm(1, 60.0, CARE)
        await asyncio.to_thread(first.close)
        await asyncio.to_thread(eventually, lambda: _meet(lines, others))
        for other in others:
            await other.write(1, 1, [RUN])
        assert written(peer) == [RUN, RUN]


async def test_next_holder_takes_over_stop_instructions(share: Share) -> None:
    heard: list[tuple[int, bytes]] = []

    def hear(device: int, care: bytes) -> bool:
        heard.append((device, care))
        return True

    with PtyPeer(prompt) as peer:
        lines = share(peer.path)
        holder, first, second = (lines.open(name, gated=True) for name in ("a", "b", "c"))
        for device in (1, 2):
            first.facts.leases.arm(device, 60.0, CARE)
            first.facts.leases.disarm(device)
        # drive 2 is another program's since, which may know better
        assert second.facts.claim(2) == ""
        second.facts.leases.arm(2, 60.0, b"its own")
        await asyncio.to_thread(eventually, lambda: first.facts.commander(2) is not None)
        second.facts.leases.disarm(2)
        second.facts.release(2)
        await asyncio.to_thread(eventually, lambda: first.facts.commander(2) is None)
        for line in (first, second):
            line.facts.accepts_care = hear
        await asyncio.to_thread(holder.close)
        await asyncio.to_thread(eventually, lambda: _meet(lines, [first, second]))
        # the holder of the line learns how to stop drives armed by the other, and arms nothing
        holds, other = first, second
        if second.facts.programs[0] == second.facts.me:
            holds, other = second, first
        expected = [(2, b"its own")] if other is second else [(1, CARE)]
        await asyncio.to_thread(eventually, lambda: heard == expected)
        assert "drive 1 is not armed" in await refusal(other)
        assert holds.facts.leases.of(other.facts.me.id) == {}
        assert written(peer) == []


async def test_stop_stays_due_if_arming_ends_with_it(share: Share) -> None:
    due: list[tuple[int, ...]] = []
    with PtyPeer(prompt) as peer:
        holder, program = pair(share, peer)
        on_event(holder.facts, StopDue, lambda event: due.append(event.devices))
        program.facts.leases.arm(1, 60.0, CARE)
        program.facts.give_stop([1], "the stop key")
        program.facts.leases.disarm(1)
        await asyncio.to_thread(program.close)
        await asyncio.to_thread(eventually, lambda: due == [(1,)])


def _meet(lines: SharedLines, programs: list[Line]) -> bool:
    names = {program.facts.me.id for program in programs}
    return all({each.id for each in program.facts.programs} == names for program in programs)


async def test_lease_ends_with_its_program(share: Share) -> None:
    with PtyPeer(prompt) as peer:
        holder, program = pair(share, peer)
        program.facts.leases.arm(1, None, CARE)
        me = program.facts.me.id
        await asyncio.to_thread(eventually, lambda: 1 in holder.facts.leases.of(me))
        await asyncio.to_thread(program.close)
        await asyncio.to_thread(eventually, lambda: holder.facts.leases.of(me) == {})


async def test_stop_not_yet_written_is_due_when_its_program_exits(share: Share) -> None:
    due: list[tuple[int, ...]] = []
    with PtyPeer(prompt) as peer:
        lines = share(peer.path)
        holder = lines.open("keeper")
        on_event(holder.facts, StopDue, lambda event: due.append(event.devices))
        for name in ("done", "gone"):
            program = lines.open(name)
            program.facts.give_stop([1], "the stop key")
            if name == "done":
                await program.write(1, 1, [STOP], priority=Priority.STOP)
            await asyncio.to_thread(program.close)
        await asyncio.to_thread(eventually, lambda: due != [])
        assert due == [(1,)]


async def test_result_of_a_write_by_an_exited_program_reaches_the_holder(
    share: Share,
) -> None:
    left: list[tuple[Program, object, float]] = []
    with PtyPeer(slow) as peer:
        holder, program = pair(share, peer)

        def hear(event: WriteAbandoned) -> None:
            event.answer.add_done_callback(
                lambda done: left.append((event.program, event.request, done.result().time))
            )

        on_event(holder.facts, WriteAbandoned, hear)
        program.facts.leases.arm(1, None, CARE)
        writes = [asyncio.create_task(program.write(1, 1, [word])) for word in (RUN, RUN + 1)]
        await asyncio.to_thread(peer.await_requests, 1)
        await asyncio.to_thread(program.close)
        await asyncio.gather(*writes, return_exceptions=True)
        await asyncio.to_thread(eventually, lambda: left != [])
        ((who, what, _),) = left
        assert (who, getattr(what, "value", None)) == (program.facts.me, RUN)
        # the other one was never sent
        await holder.read(1, 1)
        assert written(peer) == [RUN]


async def test_due_stop_is_cancelled_when_the_drive_is_armed_again(share: Share) -> None:
    """A panel that stopped a drive that was switched off, and is closed an hour later."""
    due: list[tuple[int, ...]] = []
    with PtyPeer(prompt) as peer:
        lines = share(peer.path)
        holder = lines.open("keeper", gated=True)
        on_event(holder.facts, StopDue, lambda event: due.append(event.devices))
        panel, runner = lines.open("panel"), lines.open("run")
        panel.facts.give_stop([1, 2], "the stop key")
        await asyncio.to_thread(eventually, lambda: runner.facts.stops.stamp(1) == 1)
        runner.facts.leases.arm(1, None, CARE)
        await runner.write(1, 1, [RUN])
        await asyncio.to_thread(panel.close)
        await asyncio.to_thread(eventually, lambda: due != [])
        assert due == [(2,)]


# -- without a line --------------------------------------------------------------------------------


class Leases:
    """Leases of a program `me`, whose time the test sets; `sent` is reported to the holder."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr("tui.bus.leases.time", SimpleNamespace(monotonic=lambda: self.now))
        self.stops = StopCounts()
        self.sent: list[object] = []
        self.leases = WriteLeases("me", self.stops, self.sent.append)

    @property
    def mine(self) -> WriteLease:
        return self.leases.of("me")[1]

    def refusal(self) -> str:
        return self.leases.refusal("me", 1)


def test_lease_lasts_for_its_time_and_one_renewal_more(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Leases(monkeypatch)
    here.stops.give("other", (1,), "a test")
    here.leases.arm(1, 60.0, CARE)
    assert here.mine == WriteLease(1, 1061.0, CARE)
    assert here.sent == [Armed(1, 1, 1061.0, CARE)]
    for here.now, why in ((1061.0, ""), (1061.1, "Not sent: drive 1 is not armed now.")):
        assert here.refusal() == why
    assert here.leases.refusal("me", 2) == "Not sent: drive 2 is not armed by this program."
    assert here.leases.refusal("other", 1) == "Not sent: drive 1 is not armed by this program."


def test_lease_without_a_time_lasts_until_a_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Leases(monkeypatch)
    here.leases.arm(1, None, CARE)
    here.now += 1e6
    assert here.refusal() == ""
    assert not here.mine.has_ended
    here.stops.give("other", (2,), "a test")
    assert here.refusal() == ""
    here.stops.give("other", (1,), "a test")
    assert here.refusal() == "Not sent: drive 1 was stopped after it was armed."


@pytest.mark.parametrize(("size", "known"), [(MOST_CARE, True), (MOST_CARE + 1, False), (0, False)])
def test_lease_has_the_latest_stop_instructions_or_none(
    size: int, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Leases(monkeypatch)
    here.leases.arm(1, 60.0, CARE)
    del here.sent[:]
    care = bytes(size)
    here.leases.arm(1, 60.0, care)
    assert here.mine.care == (care if known else b"")
    assert (here.refusal() == "") == known
    if not known:
        assert "does not know how to stop drive 1" in here.refusal()
    ended = [] if known else [Armed(1, 0, LEASE_ENDED, b"")]
    assert here.sent == [*ended, Armed(1, 0, 1061.0, care if known else b"")]


@pytest.mark.parametrize(("later", "until"), [(0.5, 1061.0), (1.0, 1062.0), (3.0, 1064.0)])
def test_lease_is_extended_if_a_second_is_gained(
    later: float, until: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Leases(monkeypatch)
    here.leases.stay_armed(1, 60.0)
    assert here.leases.of("me") == {}, "a drive that is not armed stays so"
    here.leases.arm(1, 60.0, CARE)
    del here.sent[:]
    here.now += later
    here.leases.stay_armed(1, None)
    assert here.mine.until == 1061.0
    here.leases.stay_armed(1, 60.0)
    assert here.mine == WriteLease(0, until, CARE)
    assert here.sent == ([Armed(1, 0, until, b"")] if until > 1061.0 else [])


@pytest.mark.parametrize("ended", [True, False])
def test_lease_that_is_not_limited_or_has_ended_is_not_extended(
    ended: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Leases(monkeypatch)
    here.leases.arm(1, 60.0 if ended else None, CARE)
    if ended:
        here.leases.disarm(1)
    before = here.mine
    here.now += 10.0
    here.leases.stay_armed(1, 60.0)
    assert here.mine == before


def test_disarmed_drive_keeps_its_stop_instructions_until_others_command_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Leases(monkeypatch)
    here.leases.disarm(1)
    assert here.sent == []
    for device in (1, 2):
        here.leases.arm(device, 60.0, CARE)
    here.stops.give("other", (1,), "a test")
    del here.sent[:]
    here.leases.disarm(1)
    assert here.mine == WriteLease(0, LEASE_ENDED, CARE)
    assert here.sent == [Armed(1, 1, LEASE_ENDED, b"")]
    here.leases.disarm(1)
    assert len(here.sent) == 1, "once is enough"
    here.leases.forget_ended([1, 2, 3])
    assert list(here.leases.of("me")) == [2], "the drive that is armed stays so"


def test_leases_of_a_program_end_together_or_by_device(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Leases(monkeypatch)
    for program in ("me", "other"):
        for device in (1, 2):
            here.leases.grant(program, device, WriteLease(0, None, CARE))
    here.leases.end("me", 1)
    assert (list(here.leases.of("me")), list(here.leases.of("other"))) == ([2], [1, 2])
    here.leases.end("other")
    assert (list(here.leases.of("me")), list(here.leases.of("other"))) == ([2], [])
    granted = here.leases.grant("me", 2, WriteLease(3, 5.0))
    assert granted == here.leases.of("me")[2] == WriteLease(3, 5.0, CARE)
