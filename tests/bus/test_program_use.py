"""The share of a line's time that each program has, as the line counts it."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from tui.bus.bounds import MOST_PROGRAMS
from tui.bus.line import Line
from tui.bus.model import LastMinute, LineCounters
from tui.bus.program import KEEPER, Program
from tui.bus.program_use import USE_WINDOW, ProgramUse, use_by_program
from tui.bus.share.beside import LineClient, LineLook, line_look, look_answer
from tui.bus.share.place import Owner, owner_of_lock

from .conftest import Share
from .peer import PtyPeer, Step, eventually, reply
from .sharing import SharedLines


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.1, reply(request)]


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_share_is_the_recent_time_of_a_program() -> None:
    clock = Clock()
    use = ProgramUse(clock)
    for step in range(600):
        clock.now += 0.1
        use.count("a", 0.06)
        if step % 3 == 0:
            use.count("b", 0.09)
    assert use.shares == pytest.approx({"a": 0.6, "b": 0.3}, rel=0.02)
    clock.now += USE_WINDOW
    assert use.shares == pytest.approx({"a": 0.22, "b": 0.11}, rel=0.03)
    clock.now += 10 * USE_WINDOW
    assert use.shares == {}


def test_use_is_bounded_to_the_programs_of_a_message() -> None:
    use = ProgramUse(Clock())
    for number in range(3 * MOST_PROGRAMS):
        use.count(f"program {number}", 1.0 + number)
    assert len(use.shares) <= MOST_PROGRAMS
    assert f"program {3 * MOST_PROGRAMS - 1}" in use.shares


def test_counters_with_an_unknown_program_can_be_encoded() -> None:
    use = ProgramUse(Clock())
    use.count("", 5.0)
    use.count("a", 5.0)
    counters = LineCounters(programs=use.shares)
    again = msgspec.msgpack.decode(msgspec.msgpack.encode(counters), type=LineCounters)
    assert list(again.programs) == ["a"]


def test_look_answer_names_programs_but_not_the_keeper() -> None:
    programs = [Program("k", KEEPER, 1), Program("a", "watch\n", 3), Program("b", "serve" * 9, 2)]
    minute = LastMinute(good=9, lost=1)
    answer = look_answer(programs, {"b": 0.51239, "k": 0.1}, minute)
    found = msgspec.json.decode(answer, type=LineLook)
    name = f"{'serve' * 7}serv…"
    assert found.clients == [LineClient(name, 2, 0.512), LineClient("watch?", 3, 0.0)]
    assert found.minute == minute


async def test_attached_programs_and_a_look_get_the_shares(share: Share) -> None:
    with PtyPeer(slow) as peer:
        lines = share(peer.path)
        owner, client = lines.open("serve"), lines.open("panel")
        for _ in range(5):
            await client.read(1, 0)
            await owner.read(1, 1)
        ids = {client.facts.me.id, owner.facts.me.id}

        def has_both(line: Line) -> bool:
            return set(line.counters.programs) == ids

        await asyncio.to_thread(eventually, lambda: has_both(owner) and has_both(client))
        shares = owner.counters.programs
        found = {program for program, _ in use_by_program(owner.facts.programs, shares)}
        assert {program.id for program in found} == ids
        answer = await asyncio.to_thread(clients, lines)
        assert {line_client.program for line_client in answer.clients} == {"serve", "panel"}
        assert all(line_client.share > 0.0 for line_client in answer.clients)
        assert answer.minute is not None
        assert answer.minute.good >= 5


def clients(lines: SharedLines) -> LineLook:
    """Answer to a program that looks at the line."""
    (lock,) = (lines.folder / "lines").glob("*.lock")
    owner = owner_of_lock(lock)
    assert owner is not None
    found = line_look(owner)
    assert found is not None
    return found


def test_look_at_a_holder_of_an_older_version_has_no_minute(tmp_path: Path) -> None:
    old = msgspec.json.encode([LineClient("watch", 3, 0.5)])

    def answer() -> None:
        connection, _ = listening.accept()
        with connection:
            connection.recv(4)
            connection.sendall(old)

    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        thread = threading.Thread(target=answer)
        thread.start()
        found = line_look(Owner(1, Program("k", KEEPER, 1), str(tmp_path / "s")))
        thread.join()
    assert found == LineLook([LineClient("watch", 3, 0.5)])


def test_look_without_an_answer_returns_none(tmp_path: Path) -> None:
    holder = Program("k", KEEPER, 1)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        begun = time.monotonic()
        assert line_look(Owner(1, holder, str(tmp_path / "s"))) is None
        assert time.monotonic() - begun < 5
    assert line_look(Owner(1, holder, str(tmp_path / "none"))) is None
