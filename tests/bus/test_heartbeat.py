"""Heartbeat of a program on a line: sent by its own thread while its loop runs."""

from __future__ import annotations

import asyncio
import itertools
import os
import socket
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from tests.limits import BEAT_INTERVAL, LOOP_HANGS, SILENT_CLIENT
from tests.line_events import on_event
from tui.bus.line_events import ProgramLost
from tui.bus.share import heartbeat as heartbeats
from tui.bus.share.heartbeat import Heartbeat
from tui.bus.share.messages import Alive, Pulse, packed
from tui.bus.share.place import Peer, owner_of, short_path

from .conftest import Share
from .peer import PtyPeer, eventually, honest
from .sharing import SharedLines, frozen, place_in


def holder_socket(lines: SharedLines) -> str:
    owner = owner_of(place_in(lines.folder))
    assert owner is not None
    return owner.socket


async def test_program_with_a_briefly_busy_loop_stays_attached(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        holder, program = lines.open("keeper"), lines.open("run")
        gone: list[str] = []
        on_event(holder.facts, ProgramLost, lambda event: gone.append(event.program.name))
        with frozen(program):
            await asyncio.sleep(SILENT_CLIENT + 0.7)
        assert (await program.read(1, 5)).words == (5,)
        assert gone == []


async def test_program_whose_loop_hangs_counts_as_gone(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        holder, program = lines.open("keeper"), lines.open("run")
        gone: list[str] = []
        on_event(holder.facts, ProgramLost, lambda event: gone.append(event.program.name))
        with frozen(program):
            patience = LOOP_HANGS + SILENT_CLIENT + 10.0
            await asyncio.to_thread(eventually, lambda: gone == ["run"], patience)
    assert LOOP_HANGS + SILENT_CLIENT + BEAT_INTERVAL < 6.0, "as docs/safety.md says"


async def test_heartbeat_continues_after_a_lost_connection(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[socket.socket] = []
    beat = Heartbeat._beat

    def noted(self: Heartbeat, connection: socket.socket | None) -> socket.socket | None:
        found = beat(self, connection)
        if found is not None and found not in made:
            made.append(found)
        return found

    monkeypatch.setattr(Heartbeat, "_beat", noted)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        holder, _ = lines.open("keeper"), lines.open("run")
        gone: list[str] = []
        on_event(holder.facts, ProgramLost, lambda event: gone.append(event.program.name))
        await asyncio.to_thread(eventually, lambda: len(made) == 1)
        made[0].shutdown(socket.SHUT_RDWR)
        await asyncio.sleep(2 * SILENT_CLIENT)
        assert len(made) == 2
        assert gone == []


async def test_heartbeat_from_another_process_is_rejected(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        program = lines.open("run")
        numbers = itertools.count(1)
        monkeypatch.setattr(
            "tui.bus.share.greeting.peer_of", lambda _: Peer(next(numbers), os.getuid())
        )
        ended = await asyncio.to_thread(_sends, holder_socket(lines), program.facts.me.id)
        assert ended


@pytest.mark.parametrize("attached", [True, False])
async def test_only_heartbeats_of_attached_programs_count(share: Share, attached: bool) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        program = lines.open("run")
        id = program.facts.me.id if attached else "nobody"
        ended = await asyncio.to_thread(_sends, holder_socket(lines), id)
        assert ended is not attached


def _sends(path: str, program: str) -> bool:
    """Send the heartbeat of a program; True if the holder ends the connection."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(1.0)
        with short_path(Path(path)) as address:
            connection.connect(address)
        connection.sendall(packed(Pulse(program)))
        try:
            connection.sendall(packed(Alive()))
            return connection.recv(1) == b""
        except TimeoutError:
            return False
        except OSError:
            return True


class Beats:
    """A heartbeat whose thread is run step by step, and what it sends."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        self.did: list[tuple[object, ...]] = []
        self.refused = self.broken = False
        self.steps: list[Callable[[], object]] = []
        self.works: list[Callable[[], None]] = []
        event = SimpleNamespace(is_set=lambda: not self.steps, wait=self._wait, set=Mock())
        threads = SimpleNamespace(Event=lambda: event, Thread=self._thread)
        monkeypatch.setattr(heartbeats, "threading", threads)
        monkeypatch.setattr(heartbeats, "monotonic", lambda: self.now)
        monkeypatch.setattr(heartbeats, "reached", self._reached)
        self.it = Heartbeat("/run/line", "me")
        self.it.close()
        event.set.assert_called_once_with()

    def _thread(self, target: Any, name: str, daemon: bool) -> Any:
        assert (name, daemon) == ("heartbeat", True)
        return SimpleNamespace(start=lambda: self.works.append(target))

    def _wait(self, seconds: float) -> None:
        assert seconds == BEAT_INTERVAL
        self.now += seconds
        self.steps.pop(0)()

    def _reached(self, path: Path, within: float) -> Any:
        self.did.append(("connect", str(path), within))
        if self.refused:
            raise ConnectionRefusedError
        return SimpleNamespace(sendall=self._send, close=lambda: self.did.append(("close",)))

    def _send(self, data: bytes) -> None:
        if self.broken:
            raise BrokenPipeError
        self.did.append((data,))

    def run(self, *steps: Callable[[], object]) -> list[tuple[object, ...]]:
        """Beat before each step; return what was done."""
        self.steps += steps
        [work] = self.works
        work()
        found, self.did = self.did, []
        return found


def test_heartbeat_greets_on_each_connection_and_rests_while_the_loop_hangs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    beats = Beats(monkeypatch)
    connect, greeting = ("connect", "/run/line", 0.5), (packed(Pulse("me")),)
    alive, close = (packed(Alive()),), ("close",)

    def nothing() -> None:
        pass

    def hang() -> None:
        beats.now += LOOP_HANGS

    assert beats.run(nothing, nothing, nothing) == [connect, greeting, alive, alive, close]
    beats.it.turn()
    assert beats.run(nothing, hang, nothing, beats.it.turn, nothing) == [
        connect, greeting, alive, alive, close
    ]  # fmt: skip
    beats.it.turn()
    breaks = lambda: setattr(beats, "broken", True)  # noqa: E731
    heals = lambda: setattr(beats, "broken", False)  # noqa: E731
    assert beats.run(breaks, heals, nothing) == [
        connect, greeting, close, connect, greeting, close
    ]  # fmt: skip
    beats.it.turn()
    beats.refused = True
    assert beats.run(nothing, nothing) == [connect, connect]
