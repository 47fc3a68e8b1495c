"""The last minutes of a line, requested from its holder without being attached: frames and notes.

A program sends PAST_HEAD instead of a Hello. The answer is a number of pieces, each after its
length; then the connection closes. It works on a lost line too.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from time import monotonic
from typing import Annotated

import msgspec
from msgspec import Meta

from ..bounds import MOST_FRAMES
from ..notes import NOTES_A_LOOK, LineNote
from ..trace import Frame
from .messages import LENGTH, LONGEST_MESSAGE, SeenFrame, seen_frames
from .place import Owner, reached

PAST_HEAD = b"PAST"
"""Read as the length of a message, this is longer than any."""
FRAMES_KEPT = 20_000
"""Frames that a keeper keeps: minutes of a serial line, some megabytes."""
PAST_WITHIN = 5.0


class LinePast(msgspec.Struct, frozen=True):
    """Frames with their times on the monotonic clock, and notes; the oldest first."""

    frames: Annotated[tuple[SeenFrame, ...], Meta(max_length=FRAMES_KEPT)] = ()
    notes: tuple[LineNote, ...] = ()


async def send_past(
    writer: asyncio.StreamWriter, frames: Sequence[Frame], notes: Sequence[LineNote]
) -> None:
    """Send the past in pieces, so that the line has its turns in between; the first is empty."""
    await _send(writer, LinePast())
    for at in range(0, len(frames), MOST_FRAMES):
        await _send(writer, LinePast(frames=seen_frames(frames[at : at + MOST_FRAMES])))
    for at in range(0, len(notes), NOTES_A_LOOK):
        await _send(writer, LinePast(notes=tuple(notes[at : at + NOTES_A_LOOK])))


async def _send(writer: asyncio.StreamWriter, piece: LinePast) -> None:
    data = msgspec.msgpack.encode(piece)
    writer.write(len(data).to_bytes(LENGTH, "big") + data)
    await writer.drain()
    await asyncio.sleep(0)


def line_past(owner: Owner) -> tuple[tuple[Frame, ...], tuple[LineNote, ...]]:
    """Request the past from the holder of a line; waits for it.

    Raises OSError if it does not answer, for example because it has an older version.
    """
    frames: list[Frame] = []
    notes: list[LineNote] = []
    end, received = monotonic() + PAST_WITHIN, False
    with reached(Path(owner.socket), PAST_WITHIN) as connection:
        connection.sendall(PAST_HEAD)
        with connection.makefile("rb") as pieces:
            while len(frames) < FRAMES_KEPT and (head := pieces.read(LENGTH)):
                piece = _piece(pieces.read(min(int.from_bytes(head, "big"), LONGEST_MESSAGE)))
                frames += [Frame(*one) for one in piece.frames]
                notes += piece.notes
                received = True
                connection.settimeout(max(0.01, end - monotonic()))
    if not received:
        raise OSError("it is of an older version, which keeps no past")
    return tuple(frames), tuple(notes)


def _piece(data: bytes) -> LinePast:
    try:
        return msgspec.msgpack.decode(data, type=LinePast)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise OSError(f"its answer is damaged: {error}") from error
