"""The past of a line, requested from its holder: frames and notes, without being attached."""

from __future__ import annotations

import asyncio
import socket
from dataclasses import replace
from pathlib import Path

import pytest

from tui.bus.bounds import MOST_FRAMES
from tui.bus.notes import LineNote
from tui.bus.program import KEEPER, Program
from tui.bus.share.beside import line_past
from tui.bus.share.place import Owner, owner_of_lock

from .conftest import Share
from .peer import PtyPeer, honest
from .sharing import QUICK, SharedLines


def owner_of(lines: SharedLines) -> Owner:
    (lock,) = (lines.folder / "lines").glob("*.lock")
    owner = owner_of_lock(lock)
    assert owner is not None
    return owner


async def test_past_returns_earlier_frames_in_several_messages(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        line = lines.open("serve", timing=replace(QUICK, trace_length=10 * MOST_FRAMES))
        for number in range(MOST_FRAMES):
            await line.read(1, number)
        line.facts.notes.leave(LineNote(2, "events", b"x"))
        frames, notes = await asyncio.to_thread(line_past, owner_of(lines))
        assert len(frames) >= 2 * MOST_FRAMES
        assert frames == line.trace
        assert notes == (LineNote(2, "events", b"x"),)


async def test_past_of_an_unused_line_is_empty(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        line = lines.open("serve")
        found = await asyncio.to_thread(line_past, owner_of(lines))
        assert found == (line.trace, ())


def test_past_of_a_holder_of_an_older_version_raises(tmp_path: Path) -> None:
    holder = Program("k", KEEPER, 1)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen()
        with pytest.raises(OSError, match="older version"):
            asyncio.run(_refused(listening, Owner(1, holder, str(tmp_path / "s"))))
    with pytest.raises(FileNotFoundError):
        line_past(Owner(1, holder, str(tmp_path / "none")))


async def _refused(listening: socket.socket, owner: Owner) -> None:
    """Close the connection without an answer, as a holder does that does not know the head."""
    asking = asyncio.create_task(asyncio.to_thread(line_past, owner))
    connection, _ = await asyncio.to_thread(listening.accept)
    connection.recv(4)
    connection.close()
    await asking
