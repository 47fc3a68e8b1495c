"""Heartbeat of a program on a line: sent by its own thread while its loop runs."""

from __future__ import annotations

import asyncio
import itertools
import os
import socket
from pathlib import Path

import pytest

from tests.limits import BEAT_INTERVAL, LOOP_HANGS, SILENT_CLIENT
from tests.line_events import on_event
from tui.bus.line_events import ProgramLost
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
