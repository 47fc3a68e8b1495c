"""Programs on a line when another one ends, is killed, or sends garbage."""

from __future__ import annotations

import asyncio
import errno
import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import msgspec
import pytest

from tests.line_events import on_event
from tui.bus.api import LineStatus, Priority
from tui.bus.errors import LineClosed, LineLost, NotShared
from tui.bus.line import Line
from tui.bus.line_events import ProgramLost, StateChanged
from tui.bus.program import Program
from tui.bus.share.messages import (
    VERSION,
    Answer,
    AnyMessage,
    Failed,
    Hello,
    Notified,
    TurnedAway,
    packed,
    unpacked,
)
from tui.bus.share.place import Owner, OwnerLock, Peer, short_path
from tui.bus.share.sharing import DISK_WITHIN, Sharing

from .conftest import NO_ECHO, Share
from .peer import PtyPeer, Step, eventually, honest, reply
from .sharing import QUICK, SharedLines, frozen, in_loop, other_program, place_in

M = TypeVar("M", bound=AnyMessage)
STRANGER = Program("stranger", "stranger", 1)
SLOW_REGISTER = 77


def slow_at_77(request: bytes, _count: int) -> Sequence[Step]:
    return [0.12, reply(request)] if request[3] == SLOW_REGISTER else [reply(request)]


def times_sent(peer: PtyPeer, function: int) -> int:
    return [(request[1], request[3]) for request in peer.requests].count((function, SLOW_REGISTER))


async def come(condition: Callable[[], bool]) -> None:
    """Wait for something while the test's own tasks go on."""
    await asyncio.to_thread(eventually, condition)


# The owner ends


async def test_owner_that_closes_hands_the_line_over_and_reads_are_repeated(
    share: Share,
) -> None:
    with PtyPeer(slow_at_77) as peer:
        lines = share(peer.path)
        owner, other, third = (lines.open(name) for name in ("panel", "watch", "remote"))
        await owner.read(1, 1)
        in_flight = asyncio.create_task(other.read(1, SLOW_REGISTER))
        await asyncio.to_thread(peer.await_requests, 2)
        waiting = [asyncio.create_task(item.read(1, 30)) for item in (other, third)]
        await asyncio.sleep(0.02)
        await asyncio.to_thread(owner.close)
        assert (await in_flight).words == (SLOW_REGISTER,)
        for task in waiting:
            assert (await task).words == (30,)
        # the same read may have been the first on the port, which identifies its adapter
        assert times_sent(peer, 3) in (2, 3)
        eventually(lambda: {line.facts.programs[0].name for line in (other, third)} != {"panel"})
        assert other.facts.programs[0] == third.facts.programs[0]
        eventually(lambda: [len(line.facts.others) for line in (other, third)] == [1, 1])


async def test_unanswered_write_is_not_repeated_by_the_next_owner_but_a_stop_is(
    share: Share,
) -> None:
    with PtyPeer(slow_at_77) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("run")
        await owner.read(1, 1)
        write = asyncio.create_task(other.write(1, SLOW_REGISTER, [1]))
        await asyncio.to_thread(peer.await_requests, 2)
        await asyncio.to_thread(owner.close)
        with pytest.raises(LineLost, match="may or may not have taken effect"):
            await write
        assert times_sent(peer, 6) == 1
        await come(lambda: other.facts.programs[0] == other.facts.me)
        third = lines.open("stop")
        stop = asyncio.create_task(third.write(1, SLOW_REGISTER, [0], priority=Priority.STOP))
        await come(lambda: times_sent(peer, 6) == 2)
        await asyncio.to_thread(other.close)
        await stop
        # the next owner sends it once more as soon as a reply proves something
        assert times_sent(peer, 6) in (3, 4)


async def test_client_that_closes_during_a_write_reports_an_unknown_outcome(
    share: Share,
) -> None:
    with PtyPeer(slow_at_77) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("run")
        await owner.read(1, 1)
        write = asyncio.create_task(other.write(1, SLOW_REGISTER, [1]))
        await asyncio.to_thread(peer.await_requests, 2)
        await asyncio.to_thread(other.close)
        with pytest.raises(LineClosed, match="may or may not have taken effect"):
            await write
        assert (await owner.read(1, 4)).words == (4,)


async def test_next_owner_waits_for_replies_to_a_killed_owner(share: Share, tmp_path: Path) -> None:
    with PtyPeer(slow_at_77) as peer, other_program(peer.path, tmp_path, "run", 1.0) as owner:
        owner.tell("read 1")
        lines = share(peer.path)
        line = lines.open("watch", timing=replace(QUICK, late_reply=1.0))
        line.describe(1, NO_ECHO)
        gone: list[str] = []
        on_event(line.facts, ProgramLost, lambda event: gone.append(event.program.name))
        owner.tell(f"write {SLOW_REGISTER} 5")
        await come(lambda: times_sent(peer, 6) == 1)
        killed = await asyncio.to_thread(owner.kill)
        assert (await line.read(1, 8)).words == (8,)
        # the reply to the write may arrive for a second; the write is not repeated
        assert peer.arrivals[-1] - peer.arrivals[-2] >= 0.99
        assert peer.arrivals[-1] - killed < 2.0
        assert times_sent(peer, 6) == 1
        # immediately if the process no longer exists
        await come(lambda: gone == ["run"])


async def test_write_lost_with_a_killed_owner_is_unknown_and_not_repeated(
    share: Share, tmp_path: Path
) -> None:
    with PtyPeer(slow_at_77) as peer, other_program(peer.path, tmp_path, "run") as owner:
        owner.tell("read 1")
        line = share(peer.path).open("remote")
        write = asyncio.create_task(line.write(1, SLOW_REGISTER, [1]))
        await come(lambda: times_sent(peer, 6) == 1)
        await asyncio.to_thread(owner.kill)
        with pytest.raises(LineLost, match="may or may not have taken effect"):
            await write
        await line.read(1, 4)
        assert times_sent(peer, 6) == 1


async def test_program_that_opens_after_a_killed_owner_waits_for_late_replies(
    share: Share, tmp_path: Path
) -> None:
    with PtyPeer(slow_at_77) as peer, other_program(peer.path, tmp_path, "run", 1.0) as owner:
        owner.tell("read 1")
        owner.tell(f"write {SLOW_REGISTER} 5")
        await come(lambda: times_sent(peer, 6) == 1)
        await asyncio.to_thread(owner.kill)
        line = share(peer.path).open("watch", timing=replace(QUICK, late_reply=1.0))
        line.describe(1, NO_ECHO)
        await line.read(1, 8)
        assert peer.arrivals[-1] - peer.arrivals[-2] >= 0.99


async def test_program_that_opens_after_a_closed_owner_waits_for_late_replies(share: Share) -> None:
    """Programs that were not attached got no notice."""
    late = replace(QUICK, late_reply=1.0)
    with PtyPeer(slow_at_77) as peer:
        lines = share(peer.path)
        owner = lines.open("panel", timing=late)
        await owner.read(1, 1)
        write = asyncio.create_task(owner.write(1, SLOW_REGISTER, [1]))
        await asyncio.to_thread(peer.await_requests, 2)
        await asyncio.to_thread(owner.close)
        # a program that ends before it has sent anything passes it on
        lines.open("hasty", timing=late, wait=None)
        await asyncio.sleep(0.1)
        lines.opened[-1].close()
        line = lines.open("watch", timing=late)
        line.describe(1, NO_ECHO)
        assert (await line.read(1, 8)).words == (8,)
        assert peer.arrivals[-1] - peer.arrivals[-2] >= 0.99
        with pytest.raises(LineClosed):
            await write


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
async def test_next_owner_reports_programs_that_exited_with_the_owner(
    share: Share, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    monkeypatch.setattr("tui.bus.share.heartbeat.BACK_WITHIN", 0.5)
    with (
        PtyPeer(honest) as peer,
        other_program(peer.path, tmp_path, "panel") as owner,
        other_program(peer.path, tmp_path, "run") as run,
    ):
        lines = share(peer.path)
        line, third = lines.open("watch"), lines.open("remote")
        run.tell("claim 4")
        eventually(lambda: line.facts.commander(4) is not None)
        gone: list[str] = []
        for item in (line, third):
            on_event(item.facts, ProgramLost, lambda event: gone.append(event.program.name))
        os.kill(run.process.pid, number)
        os.kill(owner.process.pid, 9)
        eventually(lambda: sorted(gone) == ["panel", "run"])
        assert line.facts.commander(4) is None
        # each of them once, and not the one that reconnected
        await asyncio.sleep(0.7)
        assert sorted(gone) == ["panel", "run"]


# Faulty clients


def raw(lines: SharedLines) -> socket.socket:
    """A connection to the owner's socket."""
    (path,) = (lines.folder / "run").glob("*.sock")
    connection = socket.socket(socket.AF_UNIX)
    connection.settimeout(10)
    with short_path(path) as address:
        connection.connect(address)
    return connection


def hello(version: int = VERSION) -> bytes:
    return packed(Hello(version, STRANGER, "serial:line", {}))


def answer(connection: socket.socket) -> AnyMessage:
    length = int.from_bytes(connection.recv(4, socket.MSG_WAITALL), "big")
    return unpacked(connection.recv(length, socket.MSG_WAITALL))


def answer_of_kind(connection: socket.socket, kind: type[M]) -> M:
    """Next message of a kind; others are skipped."""
    while not isinstance(reported := answer(connection), kind):
        pass
    return reported


def ask(**fields: object) -> bytes:
    requested: dict[str, object] = {
        "number": 1, "kind": "Read", "fields": {"device": 1, "address": 1, "count": 1},
        "priority": 4, "replaceable": False, "max_age": 0.0, "stamp": 0, "requested": 1e9,
    }  # fmt: skip
    data = msgspec.msgpack.encode({"type": "Asking", **requested, **fields})
    return len(data).to_bytes(4, "big") + data


NONSENSE = {
    "nothing": b"",
    "garbage": os.urandom(3000),
    "a giant length": b"\xff\xff\xff\xff" + b"x" * 1000,
    "half a message": hello()[:-3],
    "a request before the greeting": ask(),
    "an unknown kind": hello() + ask(kind="Erase"),
    "a device that cannot be": hello() + ask(fields={"device": 9000, "address": 1, "count": 1}),
    "a register that cannot be": hello() + ask(fields={"device": 1, "address": -5, "count": 1}),
    "a priority that cannot be": hello() + ask(priority=-99),
    "deep": hello() + (9000).to_bytes(4, "big") + b"\x91" * 9000,
    "no end of requests": hello() + b"".join(ask(number=n) for n in range(2000)),
}


@pytest.mark.parametrize("output", NONSENSE.values(), ids=NONSENSE.keys())
async def test_malformed_message_of_one_program_does_not_affect_others(
    share: Share, output: bytes
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        with raw(lines) as connection:
            with suppress(OSError):  # the owner does not read it to the end
                connection.sendall(output)
            for line in (owner, other):
                assert (await asyncio.wait_for(line.read(1, 5), 10)).words == (5,)
        eventually(lambda: [program.name for program in owner.facts.others] == ["watch"])
        assert (await other.read(1, 6)).words == (6,)


async def test_command_delayed_in_the_socket_is_not_sent(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        await owner.read(1, 1)
        write = {"device": 1, "address": 9, "value": 1}
        with raw(lines) as connection:
            old = time.monotonic() - 5
            connection.sendall(hello() + ask(kind="WriteOne", fields=write, requested=old))
            reported = await asyncio.to_thread(answer_of_kind, connection, Failed)
            assert reported.form.kind == "RequestRefused"
            assert "was suspended for 5 s" in reported.form.text
            # a stop is never too late
            stop = ask(number=2, kind="WriteOne", fields=write, requested=old, priority=0)
            connection.sendall(stop)
            assert (await asyncio.to_thread(answer_of_kind, connection, Answer)).number == 2
        assert [request[1] for request in peer.requests] == [3, 6]


async def test_client_that_reads_nothing_is_disconnected(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.share.attached.MOST_UNREAD", 1 << 14)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        with raw(lines) as connection:
            connection.sendall(hello())
            eventually(lambda: len(owner.facts.others) == 2)
            for _ in range(400):
                owner.facts.tell_all(1, "x" * 2000)
            eventually(lambda: len(owner.facts.others) == 1)
            assert (await other.read(1, 6)).words == (6,)


async def test_disconnected_client_reconnects(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        server = owner._engine._shared._server  # type: ignore[union-attr]
        for _ in range(5):
            in_loop(owner, lambda: [item.writer.transport.abort() for item in server._all()])
            await other.read(1, 6)
            eventually(lambda: [program.name for program in owner.facts.others] == ["watch"])
        eventually(lambda: other.state.status is LineStatus.CONNECTED)


async def test_program_of_another_version_is_refused_with_a_reason(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel")
        with raw(lines) as connection:
            connection.sendall(hello(VERSION + 1))
            reported = answer(connection)
        assert isinstance(reported, TurnedAway)
        assert "panel" in reported.why
        assert "another version" in reported.why


async def test_program_of_another_user_is_refused_with_a_reason(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel")
        foreign = Peer(4711, os.getuid() + 4711)
        monkeypatch.setattr("tui.bus.share.greeting.peer_of", lambda _: foreign)
        with pytest.raises(NotShared, match="other users only"):
            lines.open("foreign")


async def test_unreachable_owner_is_named_immediately(
    share: Share, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tui.bus.share.sharing.NO_OWNER", 0.3)
    lock = OwnerLock(place_in(tmp_path))
    assert lock.take()
    lock.tell(Owner(VERSION, STRANGER, str(tmp_path / "nothing.sock")))
    try:
        reported = r"stranger \(pid 1\) holds the line and cannot be reached"
        with PtyPeer(honest) as peer, pytest.raises(NotShared, match=reported):
            share(peer.path).open("panel")
    finally:
        lock.give_back()


async def test_client_disconnects_from_an_owner_that_sends_garbage(
    share: Share, tmp_path: Path
) -> None:
    """A foreign program that accepts connections on the socket must not hang the others."""
    lock = OwnerLock(place_in(tmp_path))
    assert lock.take()
    path = tmp_path / "odd.sock"
    with socket.socket(socket.AF_UNIX) as listening:
        with short_path(path) as address:
            listening.bind(address)
        listening.listen()
        lock.tell(Owner(VERSION, STRANGER, str(path)))
        with PtyPeer(honest) as peer:
            line = share(peer.path).open("panel", wait=None)
            for output in (b"\xff" * 9, packed(Notified(1, "hm")), b""):
                connection, _ = listening.accept()
                connection.sendall(output)
                connection.close()
            lock.give_back()
            eventually(lambda: line.state.status is LineStatus.CONNECTED)
            assert (await line.read(1, 2)).words == (2,)


# Nothing is left behind


def held() -> tuple[int, int]:
    """Number of files and threads of this process."""
    return len(os.listdir("/proc/self/fd")), threading.active_count()


async def test_repeated_attaching_leaves_nothing_behind(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        await owner.read(1, 1)

        async def visit(number: int) -> None:
            line = lines.open(f"visitor{number}")
            line.facts.claim(2)
            await line.read(1, 2)
            await asyncio.to_thread(line.close)

        await visit(0)
        eventually(lambda: not owner.facts.others)
        before = held()
        for number in range(1, 16):
            await visit(number)
        eventually(lambda: not owner.facts.others and owner.facts.commander(2) is None)
        # one more of each may be the test's own; a leak would be fifteen
        eventually(lambda: all(now <= then + 2 for now, then in zip(held(), before, strict=True)))
        loop = owner._engine._loop
        assert loop is not None
        assert len(asyncio.all_tasks(loop)) < 8
        assert len(owner.facts.departed) <= 16


async def test_program_closed_while_it_starts_listening_leaves_no_socket(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def starts_slowly(*_: object, **__: object) -> None:
        await asyncio.sleep(60)

    monkeypatch.setattr("tui.bus.share.greeting.asyncio.start_unix_server", starts_slowly)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("hasty", wait=None)
        eventually(lambda: lines.left_behind != [])
        lines.close()
        assert lines.left_behind == []


async def test_socket_of_a_killed_program_is_removed_by_the_next(
    share: Share, tmp_path: Path
) -> None:
    with PtyPeer(honest) as peer:
        with other_program(peer.path, tmp_path, "run") as owner:
            owner.kill()
        lines = share(peer.path)
        assert lines.left_behind != []
        lines.open("panel")
        lines.close()
        assert lines.left_behind == []


async def test_close_does_not_wait_for_a_frozen_owner(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        with frozen(owner):
            other = Line(lines.link, timing=QUICK, place=place_in(lines.folder), program=STRANGER)
            other.open()
            await asyncio.sleep(0.05)
            await asyncio.wait_for(asyncio.to_thread(other.close), 5)


async def test_hung_disk_does_not_keep_a_line_closed(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = threading.Event()
    take = OwnerLock.take

    def hangs(lock: OwnerLock) -> bool:
        answers.wait(30.0)
        return take(lock)

    monkeypatch.setattr(OwnerLock, "take", hangs)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        try:
            line = lines.open("panel")
            assert (await line.read(1, 100)).words == (100,)
        finally:
            answers.set()
        # the lock that was acquired too late is released
        monkeypatch.setattr(OwnerLock, "take", take)
        other = OwnerLock(place_in(lines.folder))
        await asyncio.to_thread(eventually, other.take)
        other.give_back()


async def test_closing_line_leaves_the_lock_to_the_thread_that_uses_it(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken, goes_on = threading.Event(), threading.Event()
    take = OwnerLock.take

    def slow(lock: OwnerLock) -> bool:
        got = take(lock)
        taken.set()
        goes_on.wait(30.0)
        return got

    monkeypatch.setattr(OwnerLock, "take", slow)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        line = lines.open("panel", wait=None)
        try:
            assert await asyncio.to_thread(taken.wait, 30.0)
            await asyncio.to_thread(line.close)
            monkeypatch.setattr(OwnerLock, "take", take)
            other = OwnerLock(place_in(lines.folder))
            assert not other.take()
        finally:
            goes_on.set()
        await asyncio.to_thread(eventually, other.take)
        other.give_back()


async def test_keeper_is_not_started_once_its_program_holds_the_line(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers, ended = threading.Event(), threading.Event()
    take, refused = OwnerLock.take, list[str]()

    def hangs(lock: OwnerLock) -> bool:
        answers.wait(30.0)
        return take(lock)

    def start_keeper(
        _order: object, _lock: int, started: Callable[[int], None]
    ) -> Callable[[], bool]:
        try:
            started(os.getpid())
        except OSError as error:
            refused.append(str(error))
            raise
        finally:
            ended.set()
        return bool

    monkeypatch.setattr(OwnerLock, "take", hangs)
    monkeypatch.setattr("tui.bus.share.sharing.start_keeper", start_keeper)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        place = place_in(lines.folder)
        line = Line(lines.link, timing=QUICK, place=place, share=partial(Sharing, keeper=True))
        lines.opened.append(line)
        try:
            line.open(wait=30.0)
            assert (await line.read(1, 100)).words == (100,)
            assert "its keeper has no folder" in line.facts.unkept
        finally:
            answers.set()
        assert await asyncio.to_thread(ended.wait, 30.0)
        assert refused
        monkeypatch.setattr(OwnerLock, "take", take)
        other = OwnerLock(place)
        await asyncio.to_thread(eventually, other.take)
        other.give_back()


@pytest.mark.internal_errors
async def test_error_in_sending_the_state_does_not_end_the_line(
    share: Share, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fails(_sharing: Sharing) -> None:
        raise ValueError("on purpose")

    monkeypatch.setattr(Sharing, "tell_state", fails)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        line = Line(lines.link, timing=QUICK, place=place_in(lines.folder), share=Sharing)
        lines.opened.append(line)
        line.open(wait=5.0)
        assert (await line.read(1, 100)).words == (100,)
    assert "was not sent to the programs" in caplog.text


def test_disk_has_at_most_2_s() -> None:
    assert DISK_WITHIN <= 2.0


async def test_full_disk_does_not_keep_a_line_closed(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    def is_full(_lock: OwnerLock, _owner: Owner) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(OwnerLock, "tell", is_full)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        seen: list[LineStatus] = []
        line = Line(lines.link, timing=QUICK, place=place_in(lines.folder))
        lines.opened.append(line)
        on_event(line.facts, StateChanged, lambda event: seen.append(event.state.status))
        line.open(wait=30.0)
        assert (await line.read(1, 100)).words == (100,)
        assert LineStatus.LOST not in seen
