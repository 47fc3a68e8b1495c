"""Stops by any program: they precede everything, and cancel pending writes everywhere."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import pytest

from tests.limits import HEARD_WITHIN, STOPS_KEPT
from tests.line_events import on_event
from tui.bus.api import LineStatus, Priority
from tui.bus.errors import LineError, LineLost, NoAnswer, RequestRefused
from tui.bus.line import Line
from tui.bus.line_events import DevicesStopped, StateChanged
from tui.bus.program import KEEPER
from tui.bus.share.owner_watch import OTHER_CONTAINER
from tui.bus.share.place import owner_of
from tui.bus.stop_counts import StopCounts

from .conftest import Share
from .peer import PtyPeer, Step, eventually, honest, reply
from .sharing import QUICK, frozen, in_loop, place_in

STOP, RUN = 0, 15


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.1, reply(request)]


NOT_ENDED = r"does not answer\. End that program \(kill -9 \d+\)"


async def send_stop(line: Line, device: int) -> float:
    """A stop key on a line whose owner may be frozen: without a read."""
    line.facts.give_stop([device], "the stop key")
    return await line.write(device, 1, [STOP], priority=Priority.STOP)


def stop(line: Line, *devices: int) -> list[asyncio.Task[float]]:
    """A stop key: earlier writes are cancelled, and the stop is sent first."""
    line.facts.give_stop(devices, "the stop key")
    return [asyncio.create_task(read_and_stop(line, device)) for device in devices]


async def read_and_stop(line: Line, device: int) -> float:
    await line.read(device, 3, priority=Priority.STOP)
    return await line.write(device, 1, [STOP], priority=Priority.STOP)


def all_know(programs: Sequence[Line], stops: int) -> bool:
    return all(program.facts.stops.stamp(0) == stops for program in programs)


async def refused(task: asyncio.Task[float]) -> str:
    with pytest.raises(RequestRefused) as caught:
        await task
    return str(caught.value)


async def test_stop_discards_pending_work_for_its_drive_only(
    share: Share,
) -> None:
    with PtyPeer(slow) as peer:
        lines = share(peer.path)
        programs = [lines.open(name) for name in ("panel", "remote", "run")]
        await programs[0].read(1, 1)
        reading = asyncio.create_task(programs[0].read(1, 1))
        await asyncio.to_thread(peer.await_requests, 2)
        runs = [asyncio.create_task(program.write(1, 1, [RUN])) for program in programs]
        others = [asyncio.create_task(program.write(2, 1, [RUN])) for program in programs]
        await asyncio.sleep(0.03)
        programs[1].facts.give_stop([1], "the stop key")
        stops = [asyncio.create_task(programs[1].write(1, 1, [STOP], priority=Priority.STOP))]
        for task in runs:
            assert "a stop came after it (the stop key" in await refused(task)
        await asyncio.gather(reading, *stops, *others)
        assert peer.words_written == [(1, STOP), (2, RUN), (2, RUN), (2, RUN)]
        # later writes are sent
        eventually(lambda: all(program.facts.stops.stamp(1) == 1 for program in programs))
        for program in programs:
            await program.write(1, 1, [RUN])


async def test_stop_is_counted_by_all_programs_before_their_listeners_hear_of_it(
    share: Share,
) -> None:
    """A command that a listener hands over then has been typed after the stop."""
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        programs = [lines.open(name) for name in ("panel", "remote", "run")]
        heard: dict[str, tuple[int, str]] = {}
        for line in programs:

            def hear(event: DevicesStopped, line: Line = line) -> None:
                stops = line.facts.stops
                heard[line.facts.me.name] = stops.stamp(event.devices[0]), stops.by[2]

            on_event(line.facts, DevicesStopped, hear)
        for number, line in enumerate(programs, 1):
            heard.clear()
            line.facts.give_stop([2], "the stop key")
            await asyncio.to_thread(eventually, lambda: len(heard) == 2)
            me = line.facts.me
            expected = (number, f"the stop key, {me.text}")
            assert heard == {
                other.facts.me.name: expected for other in programs if other is not line
            }


async def test_each_program_reports_a_stop_once_with_its_source(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        programs = [lines.open(name) for name in ("panel", "remote", "run")]
        heard: list[tuple[str, str]] = []
        for line in programs:
            me = line.facts.me.name

            def hear(event: DevicesStopped, me: str = me) -> None:
                heard.append((me, event.program.name))

            on_event(line.facts, DevicesStopped, hear)
        for number, line in enumerate(programs, 1):
            line.facts.give_stop([1, 2], "a key")
            eventually(partial(all_know, programs, 2 * number))
        names = {line.facts.me.name for line in programs}
        assert sorted(heard) == sorted((me, by) for me in names for by in names if me != by)


async def test_write_typed_before_a_stop_is_refused_after_it(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("run")
        await owner.read(1, 1)
        # a client that does not know of the stop yet
        with frozen(other):
            run = asyncio.create_task(other.write(1, 1, [RUN]))
            await asyncio.sleep(0.02)
            await asyncio.gather(*stop(owner, 1))
        assert "a stop came after it" in await refused(run)
        assert peer.words_written == [(1, STOP)]


async def test_stops_of_two_disconnected_programs_both_count(share: Share) -> None:
    """A greatest count of both would be the same for a write of after the one stop only."""
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        first, second = lines.open("one"), lines.open("two")
        await owner.read(1, 1)
        with frozen(first), frozen(second):
            # both are without an owner: each stops, and the first means to run again
            owner.close()
            first.facts.give_stop([1], "its key")
            run = asyncio.create_task(first.write(1, 1, [RUN]))
            await asyncio.sleep(0.02)
            second.facts.give_stop([1], "its key")
        with pytest.raises(LineError):
            await run
        eventually(lambda: [line.facts.stops.stamp(1) for line in (first, second)] == [2, 2])
        assert peer.words_written == []


async def test_stop_given_while_disconnected_is_reported_on_reconnecting(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        first, second = lines.open("one"), lines.open("two")
        heard: list[str] = []
        for line in (first, second):
            on_event(line.facts, DevicesStopped, lambda event: heard.append(str(event.devices)))
        with frozen(first), frozen(second):
            owner.close()
            first.facts.give_stop([1], "its key")
        eventually(lambda: heard == ["(1,)"])
        assert [line.facts.stops.stamp(1) for line in (first, second)] == [1, 1]


def test_stop_counts_only_increase_and_count_a_message_once() -> None:
    counts, other = StopCounts(), StopCounts()
    counts.give("a", (1, 2), "key")
    other.give("b", (1,), "key")
    assert other.learn(counts.given) == (1, 2)
    assert other.learn(counts.given) == ()
    assert (other.stamp(1), other.stamp(2), other.stamp(0)) == (2, 1, 3)
    # counts from the owner replace all but the own count
    assert counts.replace(other.given, "a") == (1,)
    counts.give("a", (1,), "key")
    assert counts.replace(other.given, "a") == ()
    assert counts.stamp(1) == 3
    # a program that left keeps its count without its name
    other.fold("a")
    assert other.given == {1: {"b": 1, "": 1}, 2: {"": 1}}
    assert (other.stamp(1), other.stamp(2)) == (2, 1)


# An owner that is frozen


async def test_stop_waits_for_a_frozen_owner_and_cancels_earlier_writes(
    share: Share,
) -> None:
    """The owner resumes with commands in its queue and sockets that a stop has cancelled."""
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other, third = (lines.open(name) for name in ("run", "stop", "remote"))
        await owner.read(1, 1)
        with frozen(owner):
            # by the owner, and by a program that does not know of the stop
            runs = [
                asyncio.create_task(owner.write(1, 1, [RUN])),
                asyncio.create_task(third.write(1, 1, [RUN])),
            ]
            await asyncio.sleep(0.05)
            begun = time.monotonic()
            with pytest.raises(LineLost, match=NOT_ENDED):
                await send_stop(other, 1)
            # before the other requests fail: a person must know
            assert time.monotonic() - begun < HEARD_WITHIN
            assert "owns the line and does not answer. End that program" in other.state.reason
            assert other.state.status is LineStatus.LOST
            assert peer.words_written == []
        for run in runs:
            assert "Not sent" in await refused(run)
        # it is sent automatically, once
        eventually(lambda: peer.words_written == [(1, STOP)])
        await owner.write(2, 1, [RUN])
        assert peer.words_written == [(1, STOP), (2, RUN)]
        eventually(lambda: other.state.status is LineStatus.CONNECTED)


async def test_stop_kept_by_a_frozen_owner_is_sent_by_the_next(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("run"), lines.open("stop")
        await owner.read(1, 1)
        with frozen(owner):
            with pytest.raises(LineLost, match=NOT_ENDED):
                await send_stop(other, 1)
            # each key press is another stop, and fails immediately
            with pytest.raises(LineLost, match=NOT_ENDED):
                await send_stop(other, 2)
            server = owner._engine._shared._server  # type: ignore[union-attr]
            in_loop(owner, lambda: [item.writer.transport.abort() for item in server._all()])
            closing = asyncio.create_task(asyncio.to_thread(owner.close))
        await closing
        await asyncio.to_thread(eventually, lambda: len(peer.words_written) == 2)
        assert sorted(peer.words_written) == [(1, STOP), (2, STOP)]


async def test_read_before_a_stop_fails_so_that_the_stop_is_sent(share: Share) -> None:
    """A stop word that waits is worth more than a look that fails: it is sent by the next owner."""
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("run"), lines.open("stop")
        await owner.read(1, 1)
        with frozen(owner):
            other.facts.give_stop([1], "the stop key")
            with pytest.raises(NoAnswer, match=NOT_ENDED):
                await other.read(1, 3, priority=Priority.STOP)
        assert (await other.read(1, 4)).words == (4,)
        assert [request[3] for request in peer.requests if request[1] == 3 and request[3] != 1] == [
            4
        ]


async def test_owner_counts_a_stop_of_a_program_that_has_exited(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("run")
        await owner.read(1, 1)
        with frozen(owner):
            late = lines.open("stop", wait=None)
            await asyncio.to_thread(eventually, lambda: "does not answer" in late.state.reason)
            run = asyncio.create_task(owner.write(1, 1, [RUN]))
            await asyncio.sleep(0.02)
            with pytest.raises(LineLost, match=NOT_ENDED):
                await send_stop(late, 1)
            late.close()
        assert "Not sent" in await refused(run)
        eventually(lambda: peer.words_written == [(1, STOP)])
        await owner.write(1, 1, [RUN])
        assert peer.words_written == [(1, STOP), (1, RUN)]


async def test_keeper_in_another_container_is_named_with_advice(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        keeper, other = lines.open(KEEPER, space="pid:[1]"), lines.open("panel")
        await other.read(1, 1)
        with frozen(keeper), pytest.raises(LineLost, match=OTHER_CONTAINER):
            await send_stop(other, 1)


async def test_request_for_frozen_owner_is_reported_and_not_sent_late(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("run"), lines.open("remote")
        await owner.read(1, 1)
        with frozen(owner):
            reading = asyncio.create_task(other.read(1, 5))
            with pytest.raises(LineLost, match=NOT_ENDED):
                await other.write(1, 1, [RUN])
            with pytest.raises(LineLost, match=NOT_ENDED):
                await reading
        await other.read(1, 2)
        assert peer.words_written == []


async def test_command_delayed_by_a_frozen_owner_is_not_sent(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("run"), lines.open("remote")
        await owner.read(1, 1)
        with frozen(owner):
            runs = [asyncio.create_task(line.write(1, 1, [RUN])) for line in (owner, other)]
            reading = asyncio.create_task(other.read(1, 7))
            await asyncio.sleep(2.3)
        for run in runs:
            assert "was suspended for" in await refused(run)
        assert (await reading).words == (7,)
        assert peer.words_written == []


async def test_program_that_was_suspended_does_not_report_a_frozen_owner(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("run")
        other = lines.open("remote")
        output: list[str] = []
        on_event(other.facts, StateChanged, lambda event: output.append(event.state.reason))
        with frozen(other):
            await asyncio.sleep(1.3)
        await other.read(1, 1)
        await asyncio.sleep(0.15)
        assert [text for text in output if "does not answer" in text] == []


async def test_reply_delayed_by_a_suspended_program_is_requested_again(
    share: Share,
) -> None:
    """Its time of arrival is unknown: it would be the time when the program resumed."""
    brisk = replace(QUICK, first_timeout=0.3, min_timeout=0.3)
    with PtyPeer(slow) as peer:
        line = share(peer.path).open("panel", timing=brisk)
        reading = asyncio.create_task(line.read(1, 5, priority=Priority.OPERATOR_READ))
        await asyncio.to_thread(peer.await_requests, 1)
        with frozen(line):
            await asyncio.sleep(1.6)
        assert (await reading).time >= peer.departures[-1] - 0.05
        assert len(peer.requests) == 2


async def test_late_client_gets_the_time_of_a_stop(share: Share) -> None:
    """A command typed before the stop, but sent to the line after it, must know of it."""
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        panel = lines.open("panel")
        before = time.monotonic()
        panel.facts.give_stop([1], "the stop key")
        late = lines.open("run")
        assert before < late.facts.stops.times[1] < time.monotonic()
        assert late.facts.stops.times == panel.facts.stops.times
        # an owner that exits passes it to the next one
        late.close()
        panel.close()
        next_owner = lines.open("next")
        assert next_owner.facts.stops.times == panel.facts.stops.times
        assert 2 not in next_owner.facts.stops.times


async def test_lock_file_records_stops_of_the_owner(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        panel, place = lines.open("panel"), place_in(lines.folder)
        panel.facts.give_stop([1], "the stop key")

        def is_reported() -> bool:
            owner = owner_of(place)
            return owner is not None and owner.stopped == panel.facts.stops.times

        await asyncio.to_thread(eventually, is_reported)


def test_stop_time_in_the_future_is_ignored() -> None:
    counts = StopCounts()
    counts.give("a", (1,), "the stop key")
    given = counts.times[1]
    counts.learn_times({1: given - 5, 2: given - 3, 3: time.monotonic() + 1000})
    assert counts.times == {1: given, 2: given - 3}
    assert counts.late_times == counts.times
    counts.learn_times({4: time.monotonic() - STOPS_KEPT - 1})
    assert 4 not in counts.late_times
    # a repeated stop message keeps the time of the stop
    counts.note("a", (1,), (1,), "the stop key")
    assert counts.times[1] == given
